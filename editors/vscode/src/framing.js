// Whether an emulator lets the editor show its page. Nothing here needs an editor.

/**
 * Whether a policy allows a frame inside pages of all these origins.
 * @param {string | null} policy the header Content-Security-Policy
 * @param {string[]} origins
 */
function allowsFrame(policy, origins) {
  const part = policy?.split(";").map(part => part.trim()).find(part => part.startsWith("frame-ancestors "));
  if (!part) return true;
  const allowed = part.split(/\s+/).slice(1);
  return origins.every(origin => allowed.includes(origin) || allowed.includes(origin.slice(0, origin.indexOf(":") + 1)));
}

module.exports = { allowsFrame };
