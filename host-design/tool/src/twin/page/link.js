// The connection to the server: requests out, pictures in.

// Pictures between two keep-alives. They answer pictures, so that a tab in the background sends them, too, and they
// stop when the computer sleeps.
const ALIVE_EVERY = 6;
const RETRY_MS = 1000;

// Calls `on.hello`, `on.picture`, `on.notice` and `on.lost`; returns a function that sends a request.
export function connect(on) {
  let socket = null;
  let pictures = 0;
  const ask = (request) => {
    if (socket !== null && socket.readyState === WebSocket.OPEN) socket.send(JSON.stringify(request));
  };
  const open = () => {
    const address = new URL('socket', location.href);
    address.protocol = 'ws:';
    socket = new WebSocket(address);
    socket.addEventListener('message', (event) => {
      const message = JSON.parse(event.data);
      if (message.hello !== undefined) on.hello(message.hello, message.you);
      if (message.notice !== undefined) on.notice(message.notice);
      if (message.picture === undefined) return;
      on.picture(message.picture);
      pictures += 1;
      if (pictures % ALIVE_EVERY === 0) ask({ ask: 'alive' });
    });
    socket.addEventListener('close', () => {
      on.lost();
      setTimeout(open, RETRY_MS);
    });
  };
  open();
  return ask;
}
