/* C++ objects of middle size get a page each, once: whoever touches one after its end is killed. */
#include <stdint.h>
#include <stdlib.h>
#include <sys/mman.h>

enum { SMALLEST = 65, LARGEST = 256, PAGE = 4096, PAGES = 1 << 18 };

static char *pages;
static long used;

void *_Znwm(size_t size) { /* operator new(unsigned long) */
    long page;
    if (size < SMALLEST || size > LARGEST) return malloc(size);
    page = __atomic_fetch_add(&used, 1, __ATOMIC_SEQ_CST);
    return page < PAGES ? pages + page * PAGE : malloc(size);
}

void _ZdlPv(void *block) { /* operator delete(void *) */
    uintptr_t place = (uintptr_t)block - (uintptr_t)pages;
    if (place < (uintptr_t)PAGES * PAGE) mprotect(block, PAGE, PROT_NONE);
    else free(block);
}

void _ZdlPvm(void *block, size_t size) { /* operator delete(void *, unsigned long) */
    (void)size;
    _ZdlPv(block);
}

__attribute__((constructor)) static void reserve(void) {
    pages = mmap(NULL, (size_t)PAGES * PAGE, PROT_READ | PROT_WRITE,
                 MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
    if (pages == MAP_FAILED) abort();
}
