"""Directives `command-line` and `exit-codes`: the reference of the command line, from the parsers themselves."""

import argparse

from docutils import nodes
from field_tables import inline, section, table
from sphinx.util.docutils import SphinxDirective

from nvhchain.cli import arguments, examples

SHARED = ("--help", "--verbose", "--log-file")
"""Options of every command."""


def commands():
    """Command → its help and its parser."""
    top = arguments.parser()
    (verbs,) = (action for action in top._actions if isinstance(action, argparse._SubParsersAction))
    about = {action.dest: action.help for action in verbs._choices_actions}
    return {name: (about[name], parser) for name, parser in verbs.choices.items()}


def value(action):
    """Value of an option as its usage shows it."""
    if action.nargs == 0:
        return ""
    if action.choices:
        return ", ".join(map(str, action.choices))
    names = action.metavar or action.dest
    shown = " ".join(names) if isinstance(names, tuple) else names
    return f"{shown} …" if action.nargs in ("+", "*") else shown


def meaning(action):
    """Help of an argument, with its default where the help does not state it."""
    stated = "default" in (action.help or "") or action.default in (None, False, [], 0, argparse.SUPPRESS)
    extra = "" if stated or not action.option_strings else f" (default: {action.default})"
    required = " (required)" if action.required and action.option_strings else ""
    return f"{action.help or ''}{extra}{required}"


def rows(actions):
    return [[", ".join(one.option_strings) or one.metavar or one.dest, value(one), meaning(one)] for one in actions]


class CommandLine(SphinxDirective):
    """One section per command: purpose, example, arguments and options."""

    def run(self):
        for module in (arguments, examples):
            self.env.note_dependency(module.__file__)
        result = []
        for name, (about, parser) in commands().items():
            own = [one for one in parser._actions if not {*one.option_strings} & {*SHARED}]
            purpose = nodes.paragraph("", "", *inline(f"{about[0].upper()}{about[1:]}."))
            example = nodes.literal_block(text=examples.COMMANDS[name], language="sh")
            listed = table(["argument", "value", "meaning"], rows(own)) if own else None
            result.append(section(f"nvhchain {name}", f"command-{name}", purpose, example, listed))
        return result


class SharedOptions(SphinxDirective):
    """Table of the options that every command has."""

    def run(self):
        _, parser = commands()["check"]
        return [
            table(["option", "value", "meaning"], rows(a for a in parser._actions if {*a.option_strings} & {*SHARED}))
        ]


class ExitCodes(SphinxDirective):
    """Table of the exit codes."""

    def run(self):
        return [table(["code", "meaning"], [[*row] for row in arguments.EXIT_CODES.items()])]


def setup(app):
    app.add_directive("command-line", CommandLine)
    app.add_directive("shared-options", SharedOptions)
    app.add_directive("exit-codes", ExitCodes)
    return {"parallel_read_safe": True}
