"""Check that docstrings and comments name their subject first, and begin with no relative clause, 'of', 'there', ...

    python deploy/check_docstrings.py robosc server/robosc_server

'Whether a job waits' leaves out the noun or the verb; 'Return True if a job waits' has both. The same holds for the
descriptions of arguments, attributes and results. A comment may begin with 'it', the next line. Exit status: 1 if
anything is found, which is printed with its place.
"""

import ast
import io
import re
import sys
import tokenize
from collections.abc import Iterator
from pathlib import Path

RELATIVES = "How|What|Whatever|When|Where|Whether|Which|Who|Whoever|Whom|Whose|Why"
CLAUSES = f"{RELATIVES}|So|That"
OPENINGS = f"{CLAUSES}|As|By|Everything|If|In|It|Nobody|Nothing|Of|Something|There|To"
DOCSTRING = re.compile(rf"\s*({OPENINGS})\b")
ITEM = re.compile(rf"\s+(?:\*{{0,2}}\w+(?: \([^)]*\))?|Returns?|Yields?|:\w+(?: [*\w]+)?):\s+({CLAUSES})\b")
COMMENT = re.compile(rf"#\s*({RELATIVES}|As|Everything|Nobody|Nothing|Of|Somebody|Something|There|To)\b")
GENERATED = re.compile(r"_pb2(_grpc)?\.py$")


def docstrings(tree: ast.Module) -> Iterator[ast.Constant]:
    """Yield every text that stands where a docstring stands: those of attributes follow an assignment."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef):
            for before, statement in zip([node, *node.body], node.body, strict=False):
                if isinstance(before, ast.Assign | ast.AnnAssign) or before is node:
                    match statement:
                        case ast.Expr(ast.Constant(str()) as text):
                            yield text


def faults(text: str) -> Iterator[tuple[int, str]]:
    """Yield the line and the opening word of each docstring of a module that does not begin with its subject."""
    for docstring in docstrings(ast.parse(text)):
        lines = str(docstring.value).splitlines() or [""]
        for number, line in enumerate(lines):
            found = ITEM.match(line) if number else DOCSTRING.match(line)
            if found is not None:
                yield docstring.lineno + number, found[1]


def comment_faults(text: str) -> Iterator[tuple[int, str]]:
    """Yield the line and the opening word of each comment that does not begin with its subject.

    The later lines of a comment go on with its sentence.
    """
    last_line = 0
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        if token.type == tokenize.COMMENT:
            line, column = token.start
            is_alone = not token.line[:column].strip()
            found = None if is_alone and line == last_line + 1 else COMMENT.match(token.string)
            if found is not None:
                yield line, found[1]
            last_line = line if is_alone else 0


def main(folders: list[str]) -> int:
    """Check all modules below folders; return the exit status."""
    missing = [folder for folder in folders if not Path(folder).is_dir()]
    if missing or not folders:
        print(f"{missing[0]} is not a folder" if missing else "name the folders to check", file=sys.stderr)
        return 2
    count = 0
    for folder in folders:
        for file in sorted(Path(folder).rglob("*.py")):
            if not GENERATED.search(file.name) and "node_modules" not in file.parts:
                text = file.read_text("utf-8")
                for line, word in (*faults(text), *comment_faults(text)):
                    print(f"{file}:{line}: begins with '{word}': name the thing, or say what is returned, first")
                    count += 1
    return 1 if count else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
