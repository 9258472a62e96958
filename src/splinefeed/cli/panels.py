"""Help in panels: the options that most calls need first, then the others by what they are about."""

from __future__ import annotations

import click

#: Title of each panel and the options in it by parameter name, in this order; what stands in none comes last.
PANELS = {
    "Tuning": "axes rule kind feed_forward runs seed machine_file",
    "Most used": "feed axis_acceleration axis_jerk machine smooth output",
    "Limits": "limits_file acceleration deceleration jerk deceleration_jerk start_feed end_feed axis_velocity "
    "axis_velocity_step chord_error orientation_error centripetal travel",
    "Planning": "strategy period method corrections contour_tolerance tangential",
    "Source and units": "source which layer units chord edges dialect start offsets tools from_line repair tolerance "
    "columns",
    "Smoothing": "corners corner_angle angle_tolerance",
    "Output": "formats tip figures no_figures figure no_compare as_json",
}


class PanelCommand(click.Command):
    """A command whose help shows its options in PANELS."""

    def format_options(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write a section for each panel."""
        params = [param for param in self.get_params(ctx) if isinstance(param, click.Option)]
        records = {param.name: record for param in params if (record := param.get_help_record(ctx))}
        for title, names in PANELS.items():
            if rows := [records.pop(name) for name in names.split() if name in records]:
                with formatter.section(title):
                    formatter.write_dl(rows)
        if records:
            with formatter.section("Other"):
                formatter.write_dl(list(records.values()))
