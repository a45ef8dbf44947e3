"""The way of docs/operations.md in a browser: a study from Prefect's form, on its page, in MLflow; with pictures."""

from __future__ import annotations

import json
from pathlib import Path

from PIL import Image

from ..browser import Page

NAME = "first"
WIDTH, HEIGHT = 1280, 900
COLOURS = 64  # a picture of a page needs no more, and is a third as large
ASSISTANT_CLOSE = '[data-component-id="mlflow.assistant.chat_panel.close"]'
FORM = """
window.fields = name => [...document.querySelectorAll('.schema-form-property')].filter(
    field => field.querySelector('.schema-form-property__label').innerText.split(' ')[0] === name);
window.fill = (name, value) => {
    const input = fields(name)[0].querySelector('select, input, textarea');
    if (input.multiple) for (const option of input.options) option.selected = value.includes(option.value);
    else Object.getOwnPropertyDescriptor(Object.getPrototypeOf(input), 'value').set.call(input, value);
    for (const event of ['input', 'change', 'blur']) input.dispatchEvent(new Event(event, {bubbles: true}));
};
"""
CHOSEN = {
    "preset": "smoke",
    "name": NAME,
    "selectors": ["General", "RuleBased_General"],
    "policies": ["BC_MLP"],
}


def start(page: Page, prefect: str, pictures: Path) -> None:
    """Start a study from the form of its deployment, after the form has refused a wrong one."""
    page.open(f"{prefect}/deployments")
    page.press("study")
    page.press("Run")
    page.press("Custom run")
    page.wait_for_text("dask_scheduler (Optional)")
    page.ask(FORM)
    for name, value in {**CHOSEN, "n_targets": "0"}.items():
        page.ask(f"fill({json.dumps(name)}, {json.dumps(value)})")
    page.press("Submit")
    page.wait_for_text("0 is less than the minimum of 1")
    page.ask("fill('n_targets', '2')")
    page.wait_for("!document.body.innerText.includes('less than the minimum')")
    picture(page, pictures / "form.png")
    while page.ask("location.search !== '?tab=Runs'"):
        page.press("Submit")
        page.wait_for("location.search === '?tab=Runs' || document.body.innerText.includes('Oops')")
        if page.ask("document.body.innerText.includes('Oops')"):  # the server's database is busy
            page.press("Close")


def watch_run(page: Page, prefect: str, pictures: Path) -> None:
    """See the stages, their lines, the verdict, a table and the figures on the page of the study's own run."""
    page.open(f"{prefect}/runs")
    page.press(f"study {NAME}")
    for text in ("✓ plan", "✓ curate", "✓ train", "✓ evaluate", "✓ track", "2 networks tested", "Completed"):
        page.wait_for_text(text)
    page.resize(WIDTH, 1400)
    picture(page, pictures / "run.png")
    page.resize(WIDTH, HEIGHT)
    page.press("Artifacts")
    for name in ("planners", "coverage", "figures", "results"):
        page.wait_for_text(name)
    page.press("results")
    page.wait_for_text("Success by selector")
    picture(page, pictures / "results.png")


def compare(page: Page, mlflow: str, pictures: Path) -> None:
    """Find the study's runs in MLflow with success, its interval, policy and selector in view."""
    page.open(f"{mlflow}/#/experiments?workflowType=machine_learning")
    page.press(NAME)
    page.wait_for_text("General, which keeps every candidate")
    page.press("All runs, best first")
    page.wait_for(f"(document.querySelector('{ASSISTANT_CLOSE}')?.click(), {in_view('selector')})")
    for column in ("success_rate", "success_low", "success_high", "policy"):
        page.wait_for(in_view(column))
    picture(page, pictures / "mlflow.png")


def in_view(column: str) -> str:
    """Say in JavaScript whether a column's whole head can be seen."""
    seen = """head => {
        const place = head.getBoundingClientRect();
        return head.contains(document.elementFromPoint(place.right - 2, place.top + place.height / 2));
    }"""
    heads = "[...document.querySelectorAll('[role=columnheader]')]"
    return f"{heads}.filter(head => head.innerText.trim() === '{column}').some({seen})"


def picture(page: Page, path: Path) -> None:
    """Write what is visible to a small PNG file."""
    page.screenshot(path)
    Image.open(path).convert("RGB").quantize(COLOURS).save(path, optimize=True)
