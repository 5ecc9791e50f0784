// The frame around every view: name, navigation, and the state of the connection.
import { h } from "../dom.js";
import { signInView } from "./signin.js";
import { jobsView } from "./jobs.js";
import { jobView } from "./job.js";
import { logView } from "./log.js";
import { workersView } from "./workers.js";
import { submitView } from "./submit.js";
import { viewerView } from "./viewer.js";
import { mark } from "./pieces.js";
import { kOfJob } from "../route.js";
import { mayChange } from "../state.js";

const kViews = { jobs: jobsView, job: jobView, log: logView, workers: workersView, submit: submitView, view: viewerView };
const kRoles = { admin: "may do everything", submit: "sees and changes jobs of its own", read: "may look" };
const kLinkWords = { connecting: "connecting …", live: "live", lost: "connection lost, trying again …" };

/** The whole page as a function of state. */
export function page(state, actions) {
  if (state.session === "out") return [skipLink(), h("main", { id: "main", class: "alone", key: "signin" }, signInView(state, actions))];
  return [
    skipLink(),
    header(state, actions),
    h("main", { id: "main", key: "main", tabindex: -1 },
      state.ui.notice ? h("p", { key: "notice", class: "toast", role: "alert" }, state.ui.notice, " ", h("button", { type: "button", class: "small quiet", onclick: actions.dismiss }, "Dismiss")) : null,
      state.session === "in" && state.ui.link ? linkQuestion(state, actions) : null,
      state.session === "in" ? (kViews[state.route.view] ?? jobsView)(state, actions) : h("p", { class: "waiting" }, "Asking the coordinator …")),
  ];
}

const named = ({ role, user }) => (user ? `${user} (${role})` : role);

/** Asks whether the link that was followed may sign in as somebody else. */
const linkQuestion = (state, actions) => h("p", { key: "link", class: "toast", role: "alert" },
  `This link signs in as ${named(state.ui.link)}. You are signed in as ${named(state.me)}. `,
  h("button", { type: "button", class: "small", onclick: actions.takeLink }, `Continue as ${named(state.ui.link)}`), " ",
  h("button", { type: "button", class: "small quiet", onclick: actions.leaveLink }, `Stay ${named(state.me)}`));

const skipLink = () => h("a", { key: "skip", class: "skip", href: "#main", onclick: toMain }, "Skip to the content");

function toMain(event) {
  event.preventDefault(); // the default would change the fragment, which is the route
  document.getElementById("main").focus();
}

function header(state, actions) {
  const here = kOfJob.has(state.route.view) ? "jobs" : state.route.view;
  const link = (view, label) => h("a", { key: view, href: `#/${view}`, "aria-current": here === view ? "page" : null }, label);
  return h("header", { key: "header", class: "top" },
    h("a", { class: "brand", href: "#/jobs", "aria-label": "Lightshaft, all jobs" }, mark(), h("span", null, "Lightshaft")),
    h("nav", { "aria-label": "Main" }, link("jobs", "Jobs"), link("workers", workersLabel(state)), mayChange(state) ? link("submit", "New job") : null),
    h("span", { class: `link ${state.link}`, role: "status" }, h("i", { "aria-hidden": "true" }), h("span", null, kLinkWords[state.link])),
    state.session === "in" ? h("span", { key: "me", class: "me", title: kRoles[state.me.role] ?? state.me.role }, state.me.user || state.me.role) : null,
    h("button", { type: "button", class: "small quiet", onclick: actions.signOut }, "Sign out"));
}

const workersLabel = (state) => ["Workers", state.workers ? h("span", { class: "count" }, state.workers.size) : null];
