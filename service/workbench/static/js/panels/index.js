/** The panels, in the order of the navigation: `{id, title, mount(el, {api, state}) -> {unmount()}}`. */

import compare from "./compare.js";
import define from "./define.js";
import download from "./download.js";
import explore from "./explore.js";
import jobs from "./jobs.js";

/** @type {{id: string, title: string, mount: function(Element, Object): {unmount: function(): void}}[]} */
export const PANELS = [define, explore, compare, download, jobs];
