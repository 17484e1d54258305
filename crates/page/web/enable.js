// @ts-check
// Which buttons may be pressed now.

import {by, giveFocusBack} from "dom";
import {needsReset} from "life";

/**
 * @param {object} now
 * @param {boolean} now.may whether this page moves the machine
 * @param {boolean} now.isOpen whether bytes go to the machine
 * @param {boolean} now.looks whether jobs can be looked at
 * @param {boolean} now.free whether nothing is under way
 * @param {import("state").State | null} now.state
 * @param {import("job").Job} now.job
 * @param {boolean} now.hasBox whether the job has an extent
 */
export function enableAll({may, isOpen, looks, free, state, job, hasBox}) {
  const allow = (/** @type {boolean} */ is, /** @type {string[]} */ ...ids) => {
    for (const id of ids) /** @type {HTMLButtonElement} */ (by(id)).disabled = !is;
  };
  for (const element of document.querySelectorAll(".drive")) /** @type {HTMLButtonElement} */ (element).disabled = !may;
  allow(may && free && job.isSound, "run");
  allow(may && free && job.isSound && job.profile !== null && !job.plain, "from");
  allow(may && free && hasBox, "frame", "level");
  allow(job.text !== "", "save");
  allow(looks && job.text !== "", "check");
  if (needsReset(state)) allow(false, "home");
  allow(isOpen, "hold", "reset");
  allow(may && /^(Hold|Door|Tool)/.test(state?.name ?? ""), "resume");
  giveFocusBack();
}
