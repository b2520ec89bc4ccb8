// Every text that is seen: the contrast of its colour to the ground behind it (WCAG 2), and which it is.
() => {
  const parse = (text) => { const [r, g, b, a = 1] = text.match(/[\d.]+/g).map(Number); return [r, g, b, a]; };
  const light = (c) => { const [r, g, b] = c.map((v) => { v /= 255; return v <= 0.03928 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4; }); return 0.2126 * r + 0.7152 * g + 0.0722 * b; };
  const ground = (el) => { for (let up = el; up; up = up.parentElement) { const c = parse(getComputedStyle(up).backgroundColor); if (c[3] > 0) return c; } return [255, 255, 255, 1]; };
  const own = (el) => [...el.childNodes].some((node) => node.nodeType === 3 && node.textContent.trim()) || ['INPUT', 'SELECT', 'TEXTAREA'].includes(el.tagName);
  const found = [];
  for (const el of document.querySelectorAll('body *')) {
    if (!own(el) || !el.checkVisibility() || el.closest('svg, .hidden-text, .plot-canvas, .skip, noscript') || el.disabled) continue;
    const [one, other] = [light(parse(getComputedStyle(el).color)), light(ground(el))];
    const ratio = (Math.max(one, other) + 0.05) / (Math.min(one, other) + 0.05);
    found.push([ratio, `${el.tagName} ${el.className} ${el.textContent.slice(0, 30)}`]);
  }
  return found;
}
