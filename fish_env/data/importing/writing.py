"""Writing an imported dataset: the CSV files, dataset.yaml and the mapping that made it."""

from pathlib import Path

from fish_env.data.description import FILE_NAME
from fish_env.data.importing.assemble import Imported
from fish_env.data.importing.plan import Content, Plan, plan_text, used_sources
from fish_env.data.writing import check_free, fish_reference, write_table
from fish_env.files import write_text
from fish_env.version import stamped

MAPPING = "import.yaml"


def write_imported(imported: Imported, plan: Plan, folder: Path) -> list[Path]:
    """Writes dataset.yaml, a CSV file for each run, and the mapping if it is not there.

    Args:
        imported: The dataset.
        plan: The mapping it was made with.
        folder: Where to write; made if it is not there.

    Returns:
        The files that were written.

    Raises:
        DatasetError: One of these files is there already.
    """
    files = {id: folder / f"{id}.csv" for id in imported.tables}
    check_free(folder, [FILE_NAME, *(file.name for file in files.values())])
    for id, columns in imported.tables.items():
        write_table(files[id], columns)
    written = list(files.values())
    if not (folder / MAPPING).exists():
        written.append(write_mapping(used_content(plan), folder))
    write_text(folder / FILE_NAME, stamped(plan_text(_placed(imported.description, folder))))
    return [*written, folder / FILE_NAME]


def used_content(plan: Plan) -> Content:
    """The mapping without sources that nothing comes from."""
    used = {name: plan.content["sources"][name] for name in used_sources(plan)}
    return {**plan.content, "sources": used}


def write_mapping(content: Content, folder: Path) -> Path:
    """Writes a mapping as import.yaml into a folder, where no file of that name is."""
    check_free(folder, [MAPPING])
    write_text(folder / MAPPING, stamped(plan_text(_placed(content, folder))))
    return folder / MAPPING


def _placed(content: Content, folder: Path) -> Content:
    """The content with the path of the fish as seen from the folder."""
    if "fish" not in content:
        return content
    return {**content, "fish": fish_reference(str(content["fish"]), folder)}
