// A real board, where the browser has Web Serial: carries the bytes between its port and the thread that talks to it.

const LAST_MS = 500; // longest wait for the motor to be turned off at the end

class SerialLine {
  // Lets the person choose a port, and opens it.
  static async open(baudRate) {
    const port = await navigator.serial.requestPort();
    await port.open({ baudRate, bufferSize: 1 << 16 });
    return new SerialLine(port);
  }

  constructor(port) {
    const { port1: here, port2: there } = new MessageChannel();
    Object.assign(this, { port, here, there, reader: port.readable.getReader(), writer: port.writable.getWriter() });
    here.onmessage = ({ data }) => {
      if (data.ended) this.ended?.();
      else this.writer.write(data).catch((error) => this.fail(error.message));
    };
    this.read();
  }

  async read() {
    try {
      for (;;) {
        const { value, done } = await this.reader.read();
        if (done) return this.fail('the port is closed');
        this.here.postMessage({ bytes: value });
      }
    } catch (error) {
      return this.fail(error.message);
    }
  }

  fail(why) { this.here.postMessage({ closed: why }); }

  // Turns the motor off, and closes the port.
  async close() {
    await new Promise((take) => {
      this.ended = take;
      this.here.postMessage({ ends: true });
      setTimeout(take, LAST_MS);
    });
    await this.reader.cancel().catch(() => {});
    await this.writer.close().catch(() => {});
    await this.port.close().catch(() => {});
  }
}
