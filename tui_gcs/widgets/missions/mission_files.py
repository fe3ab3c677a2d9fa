"""Files of missions: the one that all vehicles' plans are saved to, files of other programs, work in progress.

Independent of Textual.
"""

from pathlib import Path

from tui_gcs.core.base.autosave import Autosave
from tui_gcs.core.base.safe_files import FileRefused
from tui_gcs.core.formats.bounded import data_of
from tui_gcs.core.formats.content import Content, FormatError, Home
from tui_gcs.core.formats.conversion import ConversionOptions, convert
from tui_gcs.core.formats.drawings import planned
from tui_gcs.core.formats.file_types import Family, format_of, read_file
from tui_gcs.core.formats.wpl import HomeLine
from tui_gcs.core.missions import draft_file as store
from tui_gcs.core.missions.draft import MissionDraft
from tui_gcs.core.missions.draft_file import DraftFileError
from tui_gcs.core.plans.model import PlanKind
from tui_gcs.widgets.missions.mission_editor import MissionEditor

FILE_NAME = "missions.json"


class MissionFile:
    """The draft as a working copy that belongs into a file, and that is kept against a crash."""

    def __init__(self, editor: MissionEditor, folder: Path | None) -> None:
        """Work in progress is kept in `folder`, or nowhere if that is None."""
        self.path = ""
        self._editor = editor
        self._folder = folder
        self._autosave: Autosave | None = None
        self._known: set[str] = set()
        self._kept: MissionDraft | None = None

    @property
    def text(self) -> str:
        """The text that is saved."""
        return store.to_bytes(self._saved()).decode()

    def _saved(self) -> store.SavedDraft:
        return store.SavedDraft(self._editor.history.draft, self._editor.forecast.performance)

    def knows_text(self, text: str) -> bool:
        """Return whether a file with this content may be replaced: the draft was read from it or saved as it."""
        return text in self._known

    def saved(self, path: Path, text: str) -> None:
        """Note that the file `path` holds `text` now; nothing is in progress any more."""
        self.path = str(path)
        self._known.add(text)
        self._editor.history.saved()
        if self._autosave is not None:
            self._autosave.forget()

    def open(self, path: Path) -> str:
        """Read a file: missions of all vehicles, or plans for the edited vehicle. Raises DraftFileError."""
        editor = self._editor
        try:
            data = data_of(path, store.MAX_BYTES)
        except FormatError as error:
            raise DraftFileError(f"{path.name}: {error}") from None
        # Our own files begin so; `read_file` recognises formats of other programs.
        if data.lstrip().startswith(b'{"missions"'):
            saved = store.from_bytes(data)
            draft = saved.draft
            editor.assume(saved.performance)
            editor.take(f"{path.name} opened", draft)
            editor.history.saved()
            self.path = str(path)
            self._known.add(data.decode())
            return f"{path.name}: missions of {len(draft.vehicles)} vehicles"
        try:
            is_px4 = editor.forecast.vehicle(editor.vehicle).autopilot.startswith("PX4")
            content = read_file(data, None, HomeLine.AMSL if is_px4 else HomeLine.AUTO, path)
            if content.drawings:
                content = planned(content.drawings, None, editor.forecast.vehicle(editor.vehicle).layer_m)
        except FormatError as error:
            raise DraftFileError(f"{path.name}: {error}") from None
        return f"{path.name}: {self._take(content, path)}"

    def _take(self, content: Content, path: Path) -> str:
        """Replace the edited vehicle's plans of the kinds that the file holds. Raises DraftFileError."""
        editor = self._editor
        # QGroundControl's surveys have no way-points in the file, so nothing could be flown.
        if content.not_flown:
            parts = "; ".join(content.not_flown)
            raise DraftFileError(f"{path.name}: {parts}: the way is not in the file; save way-points in QGroundControl")
        draft, words = editor.history.draft, []
        for kind in PlanKind:
            plan = content.plan(kind)
            if plan is not None and plan.items:
                draft = draft.with_items(editor.vehicle, kind, plan.items)
                words.append(f"{kind.word} of {len(plan.items)}")
        if not words:
            raise DraftFileError(f"{path.name}: neither mission, fence nor rally points are in it")
        editor.take(f"{path.name} opened", draft)
        # In parentheses notes name options of the shell command, which do not exist here.
        notes = [note.partition(" (--")[0] for note in content.notes]
        lost = "; ".join((*content.left_out, *notes))
        return f"{', '.join(words)} for vehicle {editor.vehicle}" + (f" ({lost})" if lost else "")

    def write(self, path: Path) -> str:
        """Write the edited vehicle's plans into a new file; its ending is the format. Raises DraftFileError."""
        editor = self._editor
        wanted, draft = format_of(path.name), editor.history.draft.of(editor.vehicle)
        if wanted is None or wanted.family not in (Family.PLAN, Family.DRAWING):
            raise DraftFileError(f"{path.name}: its ending names no format of plans (.plan .waypoints .kml .geojson …)")
        mission, fence, rally = (draft.plan(kind) for kind in PlanKind)
        home = editor.forecast.vehicle(editor.vehicle).home
        lat_deg, lon_deg = editor.frame.to_geodetic(*home.place_m)
        content = Content(mission, fence, rally, Home(lat_deg, lon_deg, home.amsl_m))
        try:
            written = convert(content, wanted, ConversionOptions(title=path.stem, kind=editor.kind))
            # Exclusive: no file is overwritten, not even one that appeared a moment ago.
            with path.open("xb") as file:
                file.write(written.data)
        except FormatError as error:
            raise DraftFileError(f"{path.name}: {error}") from None
        except FileExistsError:
            raise DraftFileError(f"{path.name} is there already: choose another name") from None
        except OSError as error:
            raise DraftFileError(f"{path}: {error.strerror or error}") from None
        except ValueError as error:
            raise DraftFileError(f"{path.name}: {error}") from None
        lost = "".join(f"; left out: {line}" for line in written.left_out)
        return f"vehicle {editor.vehicle} written to {path}{lost}"

    def keep(self) -> None:
        """Keep the draft against a crash, if it has changed. Raises DraftFileError."""
        draft = self._editor.history.draft
        if self._autosave is not None and draft is not self._kept and self._editor.history.unsaved:
            try:
                self._autosave.write(self.text.encode())
            except FileRefused as error:
                raise DraftFileError(str(error)) from None
        self._kept = draft

    def recover(self) -> str:
        """Take the draft that a crash left; return a line about it, or "".

        Raises DraftFileError; then nothing is kept from here on.
        """
        if self._folder is None:
            return ""
        try:
            self._autosave = Autosave(self._folder, "missions")
            data = self._autosave.read(store.MAX_BYTES)
            if data is None:
                return ""
            try:
                saved = store.from_bytes(data)
            except DraftFileError as error:
                aside = self._autosave.set_aside(data)
                return f"what a crash left cannot be read ({error}): it is in {aside}"
        except FileRefused as error:
            raise DraftFileError(str(error)) from None
        if saved.draft.is_empty:
            return ""
        self._editor.assume(saved.performance)
        self._editor.take("recovered", saved.draft)
        self._kept = saved.draft
        count = len(saved.draft.vehicles)
        return f"recovered: plans of {count} vehicle{'s' * (count > 1)} that were not saved; u drops them"

    @property
    def waiting(self) -> tuple[Path, ...]:
        """Drafts that crashes of other consoles left."""
        return self._autosave.waiting if self._autosave is not None else ()

    def close(self) -> None:
        """Release the file of the work in progress: the next console recovers from it."""
        if self._autosave is not None:
            self._autosave.close()
            self._autosave = None
