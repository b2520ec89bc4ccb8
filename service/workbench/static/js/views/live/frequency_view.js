/** What plots over frequency share: knobs, the picture of a loop, and its margins beside it. */

import { figureTable, reasonList, verdictLine } from "../point_figures.js";
import { liveController } from "./live.js";
import { AT_POINT } from "./scope.js";

const STUDIES = ["point", "frequency_response"];

/**
 * A view of a controller's frequency responses at a point.
 * @param {Element} el
 * @param {Object} context of the view
 * @param {Object} options
 * @param {number} options.frequencies how many
 * @param {function(Object): Element[]} options.choices of what is drawn, told the answer as `liveController` tells it
 * @param {function(Element, Object): Promise<void>} options.draw the picture, told the same
 * @returns {{update: function(Set<string>): void, unmount: function(): void}}
 */
export function frequencyView(el, context, { frequencies, choices, draw }) {
  const { plot, dom } = context;
  const { h } = dom;
  const choice = h("div", { class: "row" });
  el.append(choice);
  const live = liveController(el, context, { scope: AT_POINT, studies: STUDIES, query: () => ({ frequencies }), onAnswer });
  const picture = h("div", {});
  const figures = h("div", { class: "stack" });
  live.body.append(h("div", { class: "live-wide" }, picture, figures));
  let answer = null;
  live.start();
  return { update, unmount };

  function unmount() {
    live.unmount();
    plot.forget(picture);
  }

  function update(changed) {
    if (AT_POINT.of.some((key) => changed.has(key))) {
      answer = null;
      dom.clear(choice);
    }
    live.update(changed);
    if (answer && changed.has("params")) {
      drawChoice();
      drawPicture();
    }
  }

  function onAnswer(told) {
    const first = answer === null;
    answer = told;
    if (first) drawChoice();
    const [mine, designed] = [told.now.point.controllers[0], told.designed.point.controllers[0]];
    dom.clear(figures).append(verdictLine(mine), figureTable(mine, designed), reasonList(mine));
    return drawPicture();
  }

  function drawChoice() {
    const held = [...choice.querySelectorAll("select, input")].indexOf(document.activeElement);
    dom.clear(choice).append(...choices(answer));
    if (held >= 0) choice.querySelectorAll("select, input")[held]?.focus();
  }

  function drawPicture() {
    if (answer.now.frequency_response) return draw(picture, answer);
    dom.message(picture, "refused", answer.problems.frequency_response.detail);
    return undefined;
  }
}
