"""The report of a study: tables, figures and how far they agree with the publication, as files."""

from plancurate.tasks.report.assemble import build_report
from plancurate.tasks.report.contents import Report
from plancurate.tasks.report.files import write_report
from plancurate.tasks.report.markdown import markdown
from plancurate.tasks.report.pictures import study_pictures

__all__ = ["Report", "build_report", "markdown", "study_pictures", "write_report"]
