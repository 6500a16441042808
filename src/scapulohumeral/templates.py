"""Pages made from templates: every value is escaped, and one that is missing is an error."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import jinja2


def page_template(
    package: str, name: str, filters: Mapping[str, Callable[..., str]] | None = None
) -> jinja2.Template:
    """The template of a page.

    Parameters
    ----------
    package : that the template lies in, such as "scapulohumeral.report"
    name : of the template's file
    filters : functions that the template may apply, by name
    """
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader(package, "."),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters |= filters or {}
    return environment.get_template(name)
