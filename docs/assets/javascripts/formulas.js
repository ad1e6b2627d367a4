// Draws the formulas of a page with KaTeX, from the TeX that the page holds.
document.addEventListener("DOMContentLoaded", () => {
  for (const element of document.querySelectorAll(".arithmatex")) {
    const text = element.textContent.trim(); // \( ... \) or \[ ... \]
    katex.render(text.slice(2, -2), element, { displayMode: text.startsWith("\\[") });
  }
});
