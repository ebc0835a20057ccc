// The connection to what runs the rig: requests out, pictures in.

// Pictures between two keep-alives. They answer pictures, so that a tab in the background sends them, too, and they
// stop when the computer sleeps.
const ALIVE_EVERY = 6;
const RETRY_MS = 1000;

// Calls `on.hello`, `on.picture`, `on.recorded` (the address of a recording), `on.notice` and `on.lost`; returns a
// function that sends a request. A page inside another page talks to a thread of this browser, any other to its server.
export function connect(on) {
  return location.protocol === 'about:' ? toThread(on) : toServer(on);
}

// A function that takes messages, and sends keep-alives with `ask`.
function taking(on, ask) {
  let pictures = 0;
  return (message) => {
    if (message.hello !== undefined) on.hello(message.hello, message.you);
    if (message.notice !== undefined) on.notice(message.notice);
    if (message.picture === undefined) return;
    on.picture(message.picture);
    pictures += 1;
    if (pictures % ALIVE_EVERY === 0) ask({ ask: 'alive' });
  };
}

function toServer(on) {
  let socket = null;
  const ask = (request) => {
    if (socket !== null && socket.readyState === WebSocket.OPEN) socket.send(JSON.stringify(request));
  };
  const take = taking(on, ask);
  const open = () => {
    const address = new URL('socket', location.href);
    address.protocol = 'ws:';
    socket = new WebSocket(address);
    socket.addEventListener('message', (event) => take(JSON.parse(event.data)));
    socket.addEventListener('close', () => {
      on.lost();
      setTimeout(open, RETRY_MS);
    });
  };
  open();
  return ask;
}

// The page around this one sends the port of the thread.
function toThread(on) {
  let port = null;
  let csv = null;
  const ask = (request) => port?.postMessage(request);
  const take = taking(on, ask);
  window.addEventListener('message', ({ source, ports }) => {
    if (source !== window.parent || ports.length !== 1) return;
    [port] = ports;
    port.onmessage = ({ data }) => {
      take(data);
      if (typeof data.csv !== 'string') return;
      if (csv !== null) URL.revokeObjectURL(csv);
      csv = URL.createObjectURL(new Blob([data.csv], { type: 'text/csv' }));
      on.recorded(csv);
    };
  });
  return ask;
}
