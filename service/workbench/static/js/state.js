/**
 * The one store of the workbench.
 * @typedef {Object} State
 * @property {string} panel id of the panel that is shown
 * @property {string} view id of the view in the Explore panel
 * @property {?string} designId id of the chosen design
 * @property {?Object} design its document; null until it is loaded
 * @property {?ApiProblem} designProblem why it could not be loaded
 * @property {number} point flat row-major index of the chosen grid point
 * @property {?string} controller name of the chosen controller
 * @property {Object<string, string>} params the view's own parameters, kept in the address
 * @property {?Object} draft the design request that is being written
 */

/**
 * A store.
 * @param {Object} initial its first values
 * @returns {{get: function(): State, set: function(Object): void, subscribe: function(string[], function(Set<string>, State)): function(): void}}
 */
export function createState(initial) {
  let values = Object.freeze({ ...initial });
  const watchers = new Set();

  return {
    get: () => values,

    /** Change values; those who watch a value that changed are told once. */
    set(patch) {
      const changed = new Set(Object.keys(patch).filter((key) => !same(values[key], patch[key])));
      if (changed.size === 0) return;
      values = Object.freeze({ ...values, ...patch });
      for (const watcher of [...watchers]) {
        if (watcher.keys.some((key) => changed.has(key))) watcher.tell(changed, values);
      }
    },

    /** Be told of changes of the values of these keys; answers what ends it. */
    subscribe(keys, tell) {
      const watcher = { keys, tell };
      watchers.add(watcher);
      return () => watchers.delete(watcher);
    },
  };
}

function same(one, other) {
  if (one === other) return true;
  const flat = (value) => value && typeof value === "object" && Object.getPrototypeOf(value) === Object.prototype;
  if (!flat(one) || !flat(other)) return false;
  const keys = Object.keys(one);
  return keys.length === Object.keys(other).length && keys.every((key) => one[key] === other[key]);
}
