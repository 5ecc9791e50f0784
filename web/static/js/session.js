// The first requests of the page. This module is small and comes before the others: it asks who is signed in, and for the list of
// jobs, while the rest of the page is still on its way.
import { api } from "./api.js";
import { kWholeList, listOf, parametersOf } from "./job_list.js";
import { routeOf, takeToken } from "./route.js";

/** [page of the list, who is signed in, how colours can be shown]: what is needed first. */
export const askFirst = (asked) => Promise.all([api.list(parametersOf(asked, Date.now() / 1000)), api.me(), api.views()]);

/** A link with a token signs in at once where nobody is signed in: {signing}, a promise. {me}: who is; {}: the coordinator did not say. */
export async function tryLink(token) {
  try {
    return { me: await api.me() };
  } catch (error) {
    return error.status === 401 ? { signing: later(api.signIn(token)) } : {};
  }
}

/** Whoever awaits the promise hears of its failure. */
function later(promise) {
  promise.catch(() => {});
  return promise;
}

function begin() {
  const token = takeToken(window.location, window.history);
  const route = routeOf(window.location.hash);
  const asked = route.view === "jobs" ? listOf(route.query) : kWholeList;
  const link = token ? tryLink(token) : null;
  const first = async () => {
    await (await link)?.signing;
    return askFirst(asked);
  };
  return { token, link, first: later(first()) };
}

/** Of the address at which the page was opened: its token, tryLink() of that, and askFirst() after it. */
export const opened = begin();
