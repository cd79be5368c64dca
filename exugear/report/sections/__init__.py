"""Sections of the report page: each module makes one or a few from `exugear.report.sections.material.ReportData`."""
