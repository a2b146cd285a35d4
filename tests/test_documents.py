"""The documents do what they say: see `documents.py` for what runs."""

from __future__ import annotations

import re
from pathlib import Path

import documents
import pytest
import shell

LEARNING = re.compile(
    r"torch|gough\.(?:learn|paper)|gough (?:train|evaluate|dataset|inverse-network|paper)"
)


def running() -> list:
    """Pages with something to run, marked by what that needs."""
    params = []
    for page in documents.PAGES:
        steps = documents.steps(page.read_text("utf-8"))
        needs = [pytest.mark.process] * any(
            step.kind == "shell" and shell.needs_bash(step.code) for step in steps
        )
        needs += [pytest.mark.torch] * any(LEARNING.search(step.code) for step in steps)
        if steps:
            name = page.relative_to(documents.ROOT).as_posix()
            params.append(pytest.param(page, marks=needs, id=name))
    return params


@pytest.mark.documents
@pytest.mark.parametrize("page", running())
def test_documents_run_and_print_what_they_say(page: Path) -> None:
    with documents.playground():
        wrong = documents.differences(page)
    assert not wrong, "\n".join(wrong)


@pytest.mark.parametrize("page", documents.PAGES, ids=lambda p: p.name)
def test_commands_stand_in_blocks_that_run(page: Path) -> None:
    """An indented command, or one in a block of no language, would never be tried."""
    outside = documents.FENCE.sub("", page.read_text("utf-8"))
    stray = re.findall(r"^ {4,}(?:\$ )?(?:gough|pip|make|torchrun|python3?) .*", outside, re.M)
    nameless = [
        block[0] for block in documents.FENCE.finditer(page.read_text("utf-8"))
        if not block[1] and re.search(r"^\$ ", block[2], re.M)
    ]  # fmt: skip
    assert not stray + nameless


PAGE = """
# Page

```python
x = 1 / 3
print("third", x)
```

```text
third 0.333333333
```

<!-- not run: needs a machine -->
```python
raise SystemExit
```

<!-- another comment -->
```python
print(x, x)
```
Words between.
```text
not an output
```

```console
$ gough platforms reference > mine.toml
$ head -n 1 \\
    mine.toml
# The reference platform ...
$ gough platforms nobody
gough platforms: error: no platform is called 'nobody' ...
$ echo $?
2
```

```sh
# a comment, and an empty line

gough --version  # words
echo one | cat
```

<!-- not run: takes a day -->
```sh
false
```
"""


def test_the_harness_pairs_what_runs_with_its_output() -> None:
    todo = documents.steps(PAGE)
    assert [s.kind for s in todo] == ["python"] * 2 + ["shell"] * 6
    assert [s.line for s in todo] == [5, 20, 28, 29, 32, 34, 41, 42]
    assert [s.may_fail for s in todo] == [False] * 4 + [True] + [False] * 3
    assert todo[0].output == "third 0.333333333\n"
    assert todo[3].output == "# The reference platform ...\n"
    assert [s.output is None for s in todo] == [False, True, True, False, False, False, True, True]


@pytest.mark.process
def test_the_harness_runs_python_and_commands() -> None:
    todo = documents.steps(PAGE)
    with documents.playground():
        printed = list(documents.run(Path("page.md"), todo))
        assert Path("mine.toml").is_file()
    assert printed[:2] == [f"third {1 / 3}\n", f"{1 / 3} {1 / 3}\n"]
    assert printed[2] == ""
    assert printed[5] == "2\n"
    assert printed[6].startswith("gough ")
    assert printed[7] == "one\n"
    for step, text in zip(todo, printed, strict=True):
        assert step.output is None or documents.same_output(text, step.output)


@pytest.mark.process
@pytest.mark.parametrize("block", ["```sh\nfalse\n```\n", "```console\n$ gough platforms x\n```\n"])
def test_a_command_that_fails_is_told(block: str) -> None:
    with pytest.raises(AssertionError, match=r"page.md:2: exit code [12] of:"):
        list(documents.run(Path("page.md"), documents.steps(block)))


@pytest.mark.process
def test_pipes_go_to_bash_with_the_gough_under_test() -> None:
    assert shell.run("gough --version | tr a-z A-Z")[0].startswith("GOUGH ")
    assert shell.run("gough nonsense | cat")[1] == 2


@pytest.mark.parametrize(
    ("printed", "expected", "same"),
    [
        ("a 0.3333333333 b", "a 0.33333333 b", True),
        ("a 0.3333333333 b", "a 0.3334 b", False),
        ("[1.  2.]", "[1.0 2.0]", True),
        ("a b c", "a c", False),
        ("a b c d", "a ... d", True),
        ("a b c d", "a ... e", False),
        ("a", "a ...", True),
        ("1e-17", "0", True),
        ("converged: 3", "not_converged: 3", False),
    ],
)
def test_outputs_are_compared_word_by_word(printed: str, expected: str, same: bool) -> None:
    assert documents.same_output(printed, expected) == same


def test_outputs_are_written_into_a_page(tmp_path: Path) -> None:
    page = tmp_path / "page.md"
    page.write_text("```console\n$ echo two\none\n$ echo three\nthree\n```\n", "utf-8")
    assert documents.with_outputs(page) == page.read_text("utf-8").replace("one", "two")
