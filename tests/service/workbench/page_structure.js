// What a page consists of, for those who do not see it.
() => {
  const all = (selector) => [...document.querySelectorAll(selector)];
  const seen = (el) => el.checkVisibility() && !el.closest('svg');
  const levels = all('h1, h2, h3, h4, h5, h6').filter(seen).map((el) => Number(el.tagName[1]));
  const ids = all('[id]').filter((el) => !el.closest('.plot-canvas')).map((el) => el.id);
  const aims = all('[aria-describedby], [aria-labelledby], label[for]').flatMap((el) =>
    ['aria-describedby', 'aria-labelledby', 'for'].flatMap((name) => (el.getAttribute(name) ?? '').split(' ').filter((id) => id)));
  return {
    main: all('main').length, header: all('body > header').length, status: all('[role=status][aria-live]').length,
    lang: document.documentElement.lang, title: document.title, levels, ids, aims,
    tabindex: all('[tabindex]').map((el) => el.tabIndex),
    unlabelled: all('input, select, textarea').filter((el) => seen(el) && !el.labels.length && !el.ariaLabel).map((el) => el.outerHTML),
  };
}
