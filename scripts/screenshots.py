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

PHONE_PX = 390
DESKTOP_PX = (1280, 2400)
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


def pictures(page: Path, out: Path, height: int = 5000) -> list[Path]:
    """Makes the pictures of one page.

    Args:
        page: HTML file.
        out: folder; the names begin with that of the page and of its folder.
        height: of the picture of a phone (px).

    Returns:
        The files.
    """
    out.mkdir(parents=True, exist_ok=True)
    address = page.resolve().as_uri()
    stem = str(out.resolve() / f"{page.resolve().parent.name}-{page.stem}")
    width, tall = DESKTOP_PX
    browse(address, f"--window-size={width},{tall}", f"--screenshot={stem}-desktop.png")
    # A window of Chromium is at least 500 px wide, so the phone is a frame in a page.
    with tempfile.TemporaryDirectory(prefix="phone-") as folder:
        frame = Path(folder) / "phone.html"
        frame.write_text(
            f'<body style="margin:0"><iframe src="{address}" width="{PHONE_PX}" height="{height}"'
            ' style="border:0"></iframe>',
            encoding="utf-8",
        )
        options = (f"--window-size=500,{height}", "--allow-file-access-from-files")
        browse(frame.as_uri(), *options, f"--screenshot={stem}-phone.png")
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
    parser.add_argument("--height", type=int, default=5000, help="of the phone's picture (px)")
    told = parser.parse_args()
    for page in told.pages:
        print(*pictures(page, told.out, told.height), sep="\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
