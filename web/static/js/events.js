// The coordinator's event stream. After a lost connection the browser resumes by itself with Last-Event-ID.
// If the coordinator was away for longer, or rejected the request, a new stream is opened, after pauses that
// grow. onOpen is called after every (re)connection and on `reset` (some missed events are no longer kept):
// the caller then fetches complete lists.

const kFirstPauseMs = 500;
const kLongestPauseMs = 15000;

/**
 * handlers: onEvent(type, data) for `job`, `tile` and `worker`; onOpen(); onLost(closed), closed: the answer was no
 * stream (signed out, or no coordinator). Returns a function that ends the stream for good.
 */
export function openEvents(handlers, url = "/api/v1/events") {
  let source = null;
  let pause = kFirstPauseMs;
  let timer = 0;

  function connect() {
    source = new EventSource(url);
    source.onopen = () => {
      pause = kFirstPauseMs;
      handlers.onOpen();
    };
    source.onerror = () => {
      const closed = source.readyState === EventSource.CLOSED;
      if (closed) {
        timer = setTimeout(connect, pause);
        pause = Math.min(pause * 2, kLongestPauseMs);
      }
      handlers.onLost(closed);
    };
    source.addEventListener("reset", () => handlers.onOpen());
    for (const type of ["job", "tile", "worker"]) {
      source.addEventListener(type, (event) => deliver(type, event.data));
    }
  }

  function deliver(type, text) {
    let data;
    try {
      data = JSON.parse(text);
    } catch {
      return; // a malformed event must not stop the page; the next complete list corrects its data
    }
    handlers.onEvent(type, data);
  }

  connect();
  return () => {
    clearTimeout(timer);
    source.close();
  };
}
