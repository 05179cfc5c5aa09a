/* Rapier's build for JavaScript that gives the same numbers on every machine, with the settings of rapier_js. */
export const ENGINE = {
  "package": "@dimforge/rapier3d-deterministic-compat", "descriptions": ["frame", "setter", "world", "damping"],
  "settings": {"substeps": 4, "as_installed": false}
};
export { build, start } from './rapier_js.mjs';
