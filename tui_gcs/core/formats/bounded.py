"""Reading bytes of any origin as text, JSON, XML or ZIP, limited in size, depth and number of elements.

The limits are such that the largest file that is read at all takes less than a second (docs/threats.md B.6-97). Each
error is one line.
"""

import json
import re
import zipfile
import zlib
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn

from tui_gcs.core.base.regular_file import open_plain
from tui_gcs.core.base.text import clean
from tui_gcs.core.formats.content import FormatError

if TYPE_CHECKING:
    import xml.etree.ElementTree as ET

MAX_BYTES = 4 << 20
"""The largest file: a plan of 2000 items with surveys is below 1 MB."""
MAX_DEPTH = 60
MAX_ELEMENTS = 100_000
MAX_ZIP_ENTRIES = 1000
MAX_WORDS = 150
"""How many characters of another library's error text are shown."""
_SURROGATE = re.compile(r"\\u[dD][89a-fA-F]")


def data_of(path: Path, most_bytes: int = MAX_BYTES) -> bytes:
    """Read a file, one byte more than `most_bytes` if it is larger. Raises FormatError."""
    try:
        with open_plain(path) as file:
            # One byte more than allowed shows that the file is too large, without reading it all.
            return file.read(most_bytes + 1)
    except (OSError, ValueError) as error:
        raise FormatError(error.strerror or "" if isinstance(error, OSError) else str(error)) from None


def text_of(data: bytes) -> str:
    """Decode UTF-8 text with or without a byte order mark; line ends stay. Raises FormatError."""
    if len(data) > MAX_BYTES:
        raise FormatError(f"larger than {MAX_BYTES >> 20} MB")
    # Some editors on Windows save as UTF-16: say so, instead of "line 1: is not text".
    if data[:2] in (b"\xff\xfe", b"\xfe\xff"):
        raise FormatError("is UTF-16; save it as UTF-8")
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = data[: error.start].count(b"\n") + 1
        raise FormatError(f"line {line}: is not UTF-8 text") from None
    if "\0" in text:
        raise FormatError(f"line {text[: text.index(chr(0))].count(chr(10)) + 1}: is not text")
    return text


def json_of(text: str) -> dict[str, Any]:
    """Decode a JSON object. Duplicate names, NaN and infinite numbers are refused. Raises FormatError."""
    if len(text) > MAX_BYTES:
        raise FormatError(f"larger than {MAX_BYTES >> 20} MB")
    try:
        # Python's parser takes duplicate names and NaN, which are not JSON: the hooks refuse them.
        found = json.loads(text, object_pairs_hook=_object, parse_constant=_constant)
        if _SURROGATE.search(text):  # half of a character cannot be written again
            json.dumps(found, ensure_ascii=False).encode()
    except RecursionError:
        raise FormatError("nested too deeply") from None
    except UnicodeEncodeError:
        raise FormatError("holds half of a character (a lone surrogate)") from None
    except json.JSONDecodeError as error:
        raise FormatError(f"line {error.lineno}: {clean(error.msg, MAX_WORDS)}") from None
    except ValueError as error:  # a number of thousands of digits
        raise FormatError(clean(str(error), MAX_WORDS)) from None
    if not isinstance(found, dict):
        raise FormatError("an object was expected")
    return found


def json_text(document: dict[str, Any]) -> str:
    """Encode `document` as indented JSON; names keep their order. Raises FormatError."""
    try:
        return json.dumps(document, indent=4, ensure_ascii=False, allow_nan=False) + "\n"
    except RecursionError:
        raise FormatError("nested too deeply") from None
    except ValueError:
        raise FormatError("an endless number, which JSON does not have") from None


def _object(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    found = dict(pairs)
    if len(found) != len(pairs):
        seen: set[str] = set()
        # Two values of one name: readers differ in which one counts.
        twice = next(name for name, _ in pairs if name in seen or seen.add(name))  # type: ignore[func-returns-value]
        raise FormatError(f"{clean(repr(twice), 40)} is given twice")
    return found


def _constant(name: str) -> NoReturn:
    raise FormatError(f"{name} is no number of JSON")


def xml_of(data: bytes) -> "ET.Element":
    """Parse an XML document and return its root. A document type or entities are refused. Raises FormatError."""
    # Most commands read no XML, and start faster without it.
    import xml.etree.ElementTree as ET
    from xml.parsers import expat

    if len(data) > MAX_BYTES:
        raise FormatError(f"larger than {MAX_BYTES >> 20} MB")
    builder = ET.TreeBuilder()
    depth = count = 0

    def start(tag: str, attributes: dict[str, str]) -> None:
        nonlocal depth, count
        depth, count = depth + 1, count + 1
        if depth > MAX_DEPTH:
            raise FormatError("nested too deeply")
        if count > MAX_ELEMENTS:
            raise FormatError(f"more than {MAX_ELEMENTS} elements")
        builder.start(tag, attributes)

    def end(tag: str) -> None:
        nonlocal depth
        depth -= 1
        builder.end(tag)

    def refuse(*_: object) -> NoReturn:
        raise FormatError("declares a document type or entities: refused")

    parser = expat.ParserCreate(namespace_separator="}")
    parser.buffer_text = True
    parser.StartElementHandler, parser.EndElementHandler, parser.CharacterDataHandler = start, end, builder.data
    # Entities that expand each other fill any memory ("billion laughs"); external ones read files.
    parser.StartDoctypeDeclHandler = parser.EntityDeclHandler = parser.ExternalEntityRefHandler = refuse
    try:
        parser.Parse(data, True)
        return builder.close()
    except expat.ExpatError as error:
        raise FormatError(f"line {error.lineno}: {expat.ErrorString(error.code)}") from None
    except (LookupError, ValueError) as error:  # an encoding that does not exist
        raise FormatError(clean(str(error), MAX_WORDS)) from None


def local(tag: str) -> str:
    """Return the name of an element without its namespace."""
    return tag.rpartition("}")[2]


def zip_member(data: bytes, ending: str) -> bytes:
    """Return the first file with this ending in a ZIP archive, at most `MAX_BYTES` of it. Raises FormatError."""
    if len(data) > MAX_BYTES:
        raise FormatError(f"larger than {MAX_BYTES >> 20} MB")
    # Counted before it is opened: zipfile reads the whole directory at once.
    if data.count(b"PK\x01\x02") > MAX_ZIP_ENTRIES:
        raise FormatError(f"an archive of more than {MAX_ZIP_ENTRIES} files")
    try:
        with zipfile.ZipFile(BytesIO(data)) as archive:
            found = next((info for info in archive.infolist() if info.filename.lower().endswith(ending)), None)
            if found is None:
                raise FormatError(f"an archive without a {ending} file")
            # Other methods unpack without a bound on memory.
            if found.compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED):
                raise FormatError("an archive packed in an unusual way: only stored or deflated")
            with archive.open(found) as member:
                inside = member.read(MAX_BYTES + 1)
    except (zipfile.BadZipFile, zlib.error, EOFError, NotImplementedError, RuntimeError, ValueError, OSError) as error:
        raise FormatError(f"not an archive that can be read: {clean(str(error), MAX_WORDS)}") from None
    if len(inside) > MAX_BYTES:
        raise FormatError(f"unpacks to more than {MAX_BYTES >> 20} MB")
    return inside


def zip_of(name: str, data: bytes) -> bytes:
    """Make a ZIP archive with one file. Equal contents give equal bytes."""
    target = BytesIO()
    with zipfile.ZipFile(target, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr(zipfile.ZipInfo(name, (1980, 1, 1, 0, 0, 0)), data, zipfile.ZIP_DEFLATED)
    return target.getvalue()
