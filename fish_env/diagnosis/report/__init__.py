"""The diagnosis as one page that opens without a network, and its figures as files."""

from fish_env.diagnosis.report.page import write_report
from fish_env.diagnosis.report.series import ReportSeries, RunSeries, SteadySeries, series_from

__all__ = ["ReportSeries", "RunSeries", "SteadySeries", "series_from", "write_report"]
