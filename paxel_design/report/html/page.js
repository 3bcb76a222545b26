// The page without its bodies: contents that unfold and follow the reader, boxes that scroll, pictures that enlarge.
"use strict";

(() => {
  const nav = document.querySelector("nav");
  const fold = document.querySelector(".fold");
  fold.addEventListener("click", () => {
    fold.setAttribute("aria-expanded", String(fold.getAttribute("aria-expanded") !== "true"));
  });
  document.getElementById("contents").addEventListener("click", () => fold.setAttribute("aria-expanded", "false"));

  // The section at the upper third of the window is the one that is read.
  const entries = new Map();
  for (const link of document.querySelectorAll("#contents > li > a")) entries.set(link.getAttribute("href").slice(1), link);
  const follow = new IntersectionObserver(
    (seen) => {
      for (const { target, isIntersecting } of seen) {
        const entry = entries.get(target.id);
        if (isIntersecting) entry.setAttribute("aria-current", "true");
        else entry.removeAttribute("aria-current");
        // Long contents scroll along.
        if (isIntersecting) nav.scrollTop = entry.offsetTop - nav.clientHeight / 3;
      }
    },
    { rootMargin: "-33% 0px -66% 0px" },
  );
  for (const id of entries.keys()) follow.observe(document.getElementById(id));

  // What scrolls sideways must be reachable by keyboard; what does not is no stop.
  const boxes = document.querySelectorAll(".scroll");
  const reach = () => {
    for (const box of boxes) {
      if (box.scrollWidth > box.clientWidth + 1) box.tabIndex = 0;
      else box.removeAttribute("tabindex");
    }
  };
  addEventListener("resize", reach);
  reach();

  const dialog = document.createElement("dialog");
  const large = document.createElement("img");
  dialog.append(large);
  dialog.addEventListener("click", () => dialog.close());
  document.body.append(dialog);
  const enlarge = (image) => {
    const fit = Math.min(innerWidth / image.naturalWidth, innerHeight / image.naturalHeight);
    const pixelated = image.classList.contains("pixelated");
    // Pixels are enlarged by whole numbers; a photograph up to twice.
    const scale = fit < 1 ? fit : pixelated ? Math.floor(fit) : Math.min(fit, 2);
    large.width = Math.floor(image.naturalWidth * scale);
    large.height = Math.floor(image.naturalHeight * scale);
    large.classList.toggle("pixelated", pixelated);
    large.src = image.src;
    large.alt = image.alt;
    dialog.showModal();
  };
  for (const button of document.querySelectorAll(".enlarge")) {
    button.disabled = false;
    button.addEventListener("click", () => enlarge(button.querySelector("img")));
  }
})();
