// The page for users without a session.
import { h } from "../dom.js";
import { mark } from "./pieces.js";

export function signInView(state, actions) {
  const submit = (event) => {
    event.preventDefault();
    actions.signIn(new FormData(event.currentTarget).get("token").trim());
  };
  return h("form", { class: "signin", onsubmit: submit },
    h("h1", null, mark(), "Lightshaft"),
    h("label", { for: "token" }, "Token"),
    h("input", { id: "token", name: "token", type: "password", required: true, autofocus: true, autocomplete: "current-password", spellcheck: "false", "aria-describedby": "token-help", "aria-invalid": state.ui.signInError ? "true" : null }),
    state.ui.signInError ? h("p", { key: "error", class: "field-error", role: "alert" }, state.ui.signInError) : null,
    h("button", { type: "submit", class: "primary", disabled: state.ui.signingIn }, state.ui.signingIn ? "Signing in …" : "Sign in"),
    h("p", { id: "token-help", class: "help" }, "Whoever runs the farm gives you a token. The first one, an administrator’s, is in the file ", h("code", null, "token"), " in the coordinator’s data folder:"),
    h("pre", { tabindex: 0 }, "cat DATA/token"));
}
