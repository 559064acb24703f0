"""Speed against error: a page of figures measured on this machine, each with its aim."""

from sphshell_pin.study.report.making import PAGE, Report, make_report

__all__ = ["PAGE", "Report", "make_report"]
