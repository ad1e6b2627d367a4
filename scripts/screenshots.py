"""Pictures of pages as people see them: `python -m scripts.screenshots PAGE... --out FOLDER`.

Chromium shows each HTML page (a report, a replay page, a page of the site) on a desktop and on a
phone, and prints it to a PDF, which becomes pictures in colour and in black and white. Look at the
pictures: what is cut off, overlaps or cannot be told apart without colour is a fault. Needs
`chromium` and `pdftoppm` (Debian packages chromium and poppler-utils).
"""

from __future__ import annotations

import argparse
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

WIDTHS_PX = {"desktop": 1280, "phone": 390}
BROWSERS = ("chromium", "chromium-browser", "google-chrome")


class ProgramError(Exception):
    """A program is missing."""


def program(*names: str) -> str:
    """The path of the first of some programs that is installed.

    Raises:
        ProgramError: none is.
    """
    found = next(filter(None, map(shutil.which, names)), None)
    if found is None:
        raise ProgramError(f"none of {', '.join(names)} is installed")
    return found


def browse(page: str, *options: str) -> None:
    """Lets Chromium open a page without a screen.

    Args:
        page: address.
        options: what it makes of it.
    """
    with tempfile.TemporaryDirectory(prefix="profile-") as profile:
        command = [program(*BROWSERS), "--headless", "--no-sandbox", "--hide-scrollbars"]
        command += ["--enable-unsafe-swiftshader", "--virtual-time-budget=8000"]
        command += [f"--user-data-dir={profile}", *options, page]
        subprocess.run(command, check=True, capture_output=True, timeout=180)


def framed(page: str, picture: Path, width: int, height: int) -> None:
    """A picture of a page in a frame.

    A window of Chromium is at least 500 px wide, and its pictures of WebGL are empty.

    Args:
        page: address.
        picture: file to write.
        width: of the frame (px).
        height: of the frame (px).
    """
    with tempfile.TemporaryDirectory(prefix="frame-") as folder:
        frame = Path(folder) / "frame.html"
        frame.write_text(
            f'<body style="margin:0"><iframe src="{page}" width="{width}" height="{height}"'
            ' style="border:0"></iframe>',
            encoding="utf-8",
        )
        options = ("--allow-file-access-from-files", f"--window-size={max(width, 500)},{height}")
        browse(frame.as_uri(), *options, f"--screenshot={picture}")


def pictures(page: Path, out: Path, height: int = 5000) -> list[Path]:
    """Makes the pictures of one page.

    Args:
        page: HTML file.
        out: folder; the names begin with that of the page and of its folder.
        height: of the pictures of a desktop and of a phone (px).

    Returns:
        The files.
    """
    out.mkdir(parents=True, exist_ok=True)
    address = page.resolve().as_uri()
    stem = str(out.resolve() / f"{page.resolve().parent.name}-{page.stem}")
    for name, width in WIDTHS_PX.items():
        framed(address, Path(f"{stem}-{name}.png"), width, height)
    browse(address, "--no-pdf-header-footer", f"--print-to-pdf={stem}.pdf")
    for name, options in {"print": (), "grey": ("-gray",)}.items():
        command = [program("pdftoppm"), "-r", "70", "-png", *options, f"{stem}.pdf"]
        subprocess.run([*command, f"{stem}-{name}"], check=True)
    return sorted(out.glob(f"{Path(stem).name}*"))


def main() -> int:
    """Makes pictures of all pages that are named."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("pages", nargs="+", type=Path, metavar="PAGE", help="HTML files")
    parser.add_argument("--out", type=Path, default=Path("out/screenshots"))
    parser.add_argument("--height", type=int, default=5000, help="of pictures (px)")
    told = parser.parse_args()
    for page in told.pages:
        print(*pictures(page, told.out, told.height), sep="\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
