// Waiting for a page. It is asked from here: a poll that runs inside a page that has just been opened sometimes stops
// after its first look, and the page is blamed for standing still.

const EVERY_MS = 50;

/** Waits until an expression or function is true in the page; else fails after `ms`, telling what the page says. */
export async function until(page, isSo, ms = 120_000) {
  // A page that is opened again cannot be asked meanwhile.
  const ask = () => page.evaluate(isSo).catch((fault) => fault);
  const end = Date.now() + ms;
  let found;
  while ((found = await ask()) !== true) {
    if (end < Date.now()) throw new Error(`${found} after ${ms / 1000} s: ${isSo}; the page: ${await told(page)}`);
    await new Promise((later) => setTimeout(later, EVERY_MS));
  }
}

async function told(page) {
  const { frames, loaded, ...state } = await page.evaluate("window.tiefort?.state() ?? {}").catch(() => ({}));
  return JSON.stringify({ ...state, loaded: loaded?.length });
}
