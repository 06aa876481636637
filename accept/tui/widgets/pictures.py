"""Pictures of a step beside each other where the screen is wide; the whole screen shows them behind a key."""

import math
from collections.abc import Mapping, Sequence

import numpy as np
from textual.app import ComposeResult
from textual.containers import Horizontal, Vertical
from textual.widget import Widget

from accept.pictures.labels import label_of
from accept.tui.widgets.plot import HUGE_FROM, TALL_FROM, WIDE_FROM, PanelView
from accept.tui.widgets.target import offset_panel
from accept.workflow.session import Session
from accept.workflow.steps.plan import WorkflowStep
from accept.workflow.steps.section import repeated
from checks.acceptance import POSITIONS_MM
from checks.picture import Heights, Line, Mark, Panel
from checks.verdict import Verdict

TARGET = "target"  # name of a panel that needs height


def pictures_of(session: Session, step: WorkflowStep) -> Mapping[str, Panel]:
    """Return the pictures of a step's last judgement; before them where the APA sits, and before any judgement the
    points of the probe with the next one."""
    panels, judgement = session.judgements.panels(step.name), session.judgements.of_step(step.name)
    target = None if judgement is None else offset_panel(judgement.findings, session.judgements.before)
    if target is not None:
        return {TARGET: target, **panels}
    return panels or _points(session, step)


def _points(session: Session, step: WorkflowStep) -> Mapping[str, Panel]:
    """Return the plan of the probe's heights as they are taken, none at another step."""
    heights, state = step.check.inputs.get("z_um"), session.state(step.name)
    positions = np.asarray(step.asked.settings.get("positions_mm", POSITIONS_MM), dtype=float)
    if step.check.name != "flatness" or heights is None or state.link("points") is not None:
        return {}
    means = (repeated(state.readings(heights.name, n), step.asked, heights.name) for n in range(len(positions)))
    z = np.array([math.nan if mean is None else mean.value for mean in means])
    item = Heights(positions[:, 0], positions[:, 1], z, "height as read [um]")
    return {"heights": Panel("Interfaces seen from above", "x [mm]", "y [mm]", (item,), equal=True)}


def units_before(session: Session, step: WorkflowStep) -> Sequence[Panel]:
    """Return a panel for each limit of a step, with the values of the last units and of this one."""
    judgement, panels = session.judgements.of_step(step.name), []
    own = {f.quantity: f for f in judgement.findings if f.value is not None} if judgement is not None else {}
    for name, limit in step.asked.limits.items():
        if values := session.judgements.earlier.get(name, ()):
            marks = [Mark(at, "y") for at in (limit.lower, limit.upper) if at is not None]
            if (f := own.get(name)) is not None and f.value is not None:
                marks.append(Mark(f.value, "y", "this unit", "good" if f.verdict is Verdict.PASS else "bad"))
            x = np.arange(-float(len(values)), 0.0)
            line = Line(x, np.array(values[::-1], dtype=float), style="points", role="data")
            title = f"{label_of(name)}, the last {len(values)} units"
            panels.append(Panel(title, "units before", f"[{limit.unit}]", (line, *marks)))
    return panels


def first_pictures(session: Session, most: int) -> Sequence[Panel]:
    """Return a picture of each step in their order, at most so many: those that did not pass are left out last."""
    found = []
    for n, step in enumerate(session.steps):
        panels = [*pictures_of(session, step).values(), *units_before(session, step)]
        judgement = session.judgements.of_step(step.name)
        if panels and judgement is not None:
            passed = all(f.verdict is Verdict.PASS for f in judgement.findings)
            found.append((passed, n, panels[0]))
    chosen = sorted(found, key=lambda each: each[:2])[:most]  # what did not pass first
    return [panel for _, _, panel in sorted(chosen, key=lambda each: each[1])]


async def show_in(holder: Widget, panels: Sequence[Panel]) -> None:
    """Show panels in a part of the screen, in the views that it has already as far as these go."""
    views = list(holder.query(PanelView))
    for view, panel in zip(views, panels, strict=False):
        view.show(panel)
    for view in views[len(panels) :]:
        await view.remove()
    if holder.is_attached:  # left while the old ones went
        await holder.mount(*(PanelView(panel) for panel in panels[len(views) :]))


class Pictures(Vertical):
    """Shows panels beside each other, from the first one on."""

    def __init__(self) -> None:
        super().__init__(id="pictures")
        self.panels: Mapping[str, Panel] = {}
        self.is_tab = False  # on a small terminal, which has no room for them beside the form

    def be_tab(self, shown: bool) -> None:
        """Take the place of the form on a small terminal, or leave it."""
        self.is_tab = shown
        self._draw()

    def compose(self) -> ComposeResult:
        yield Horizontal(classes="panels")

    def show(self, panels: Mapping[str, Panel]) -> None:
        given, known = list(panels.values()), list(self.panels.values())
        self.panels = dict(panels)
        if len(given) != len(known) or any(a is not b for a, b in zip(given, known, strict=True)):
            self._draw()

    def on_resize(self) -> None:
        """Draw again: another width may have room for another number."""
        if len(self.query(PanelView)) != len(self._shown()):
            self._draw()

    def _shown(self) -> list[Panel]:
        width, height = self.app.size
        beside = 3 if width >= HUGE_FROM else 1 if TARGET in self.panels and height < TALL_FROM else 2
        return list(self.panels.values())[: beside if width >= WIDE_FROM else int(self.is_tab)]

    def _draw(self) -> None:
        """Draw by a message to itself, one after the other; not as a worker: to cancel one that waits for the old
        panels to go would cancel their tasks, and with them those of the screen and of the whole program."""
        if self.is_attached and self.query(".panels"):
            self.call_later(self._redraw)

    async def _redraw(self) -> None:
        shown = self._shown()
        self.display = bool(shown)
        await show_in(self.query_one(".panels"), shown)
