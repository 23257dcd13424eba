"""One self-contained HTML file that says what a diagnosis found; draws, computes nothing."""

from corexy_fmi.report.page import render_report, write_report

__all__ = ["render_report", "write_report"]
