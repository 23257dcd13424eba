"""The command ``corexy``: its commands, and what an error or an interrupt does to the process."""

from __future__ import annotations

import signal
import sys
from types import FrameType

import typer

from corexy_fmi.commands import (
    build,
    demo,
    diagnose,
    effects,
    fleet,
    hil,
    import_,
    machine,
    plan,
    pulses,
    rectangle,
    reproduce,
    simulate,
    sweep,
)
from corexy_fmi.commands.streams import FULL, mute, open_streams, trouble
from corexy_fmi.errors import InputError

NO_ROOM, BAD_INPUT, INTERRUPTED = 1, 2, 130
SIGNALS = ("SIGTERM", "SIGHUP")  # the second when a terminal goes away; Windows has none

app = typer.Typer(
    name="corexy",
    help="Dynamics of Core-XY belt stages as an FMU, and what a recording shows a model to lack.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode="markdown",
    context_settings={"help_option_names": ["-h", "--help"]},
)
app.command("demo")(demo.demo)
app.command("rectangle")(rectangle.rectangle)
app.command("simulate")(simulate.simulate)
app.command("pulses")(pulses.pulses)
app.command("diagnose", cls=diagnose.ManyHoldouts)(diagnose.diagnose)
app.command("fleet")(fleet.fleet)
app.command("plan")(plan.plan)
app.command("sweep")(sweep.sweep)
app.command("effects")(effects.effects)
app.command("build")(build.build)
app.add_typer(import_.app, name="import")
app.add_typer(machine.app, name="machine")
app.add_typer(hil.app, name="hil")
app.add_typer(reproduce.app, name="reproduce")


def main() -> None:
    """Run the command line and leave with its status: 0, 2 for bad input, 130 when interrupted."""
    open_streams()
    for name in SIGNALS:
        number = getattr(signal, name, None)
        if number is not None and signal.getsignal(number) is not signal.SIG_IGN:  # nohup
            signal.signal(number, _terminate)
    sys.exit(run())


def run() -> int:
    """Exit status; a mistake of the user is one line on stderr."""
    try:
        status = app(prog_name="corexy", standalone_mode=False)
        sys.stdout.flush()
    except InputError as error:
        return _say(str(error), BAD_INPUT)
    except (KeyboardInterrupt, typer.Abort):
        status = INTERRUPTED
    except OSError as error:
        return _surroundings(error)
    except Exception as error:
        if not hasattr(error, "format_message"):  # typer's usage errors can say what is wrong
            raise
        return _say(f"{_path(error)}: {error.format_message()}", BAD_INPUT)
    if status == INTERRUPTED:
        return _say("interrupted, nothing was left half-written", INTERRUPTED)
    return status if isinstance(status, int) else 0


def _surroundings(error: OSError) -> int:
    """Exit status where a stream or the current folder fails; raises every other error."""
    if isinstance(error, BrokenPipeError) and error.filename is None:
        mute()
        return NO_ROOM
    line = trouble(error)
    if line is None:
        raise error
    mute()
    return _say(line, NO_ROOM if error.errno in FULL else BAD_INPUT)


def _say(line: str, status: int) -> int:
    print(" ".join(line.split()), file=sys.stderr)
    return status


def _path(error: Exception) -> str:
    """The command that was called wrongly."""
    context = getattr(error, "ctx", None)
    return str(context.command_path) if context is not None else "corexy"


def _terminate(number: int, frame: FrameType | None) -> None:
    """A signal to end unwinds the stack, so that files written beside their place are removed."""
    raise SystemExit(128 + number)
