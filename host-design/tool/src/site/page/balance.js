// Balance it: the twin's page inside this one, and the thread that runs its rig.

class Twin {
  constructor(module, failed) {
    Object.assign(this, { module, failed, frame: null, thread: null, line: null });
    byId('close').addEventListener('click', () => this.close());
    // Stop works wherever the focus is.
    document.addEventListener('keydown', (event) => {
      if (event.key === 'Escape') this.frame?.contentDocument.dispatchEvent(new KeyboardEvent('keydown', { key: 'Escape' }));
    });
  }

  // Switches the rig on: its file, its stored motions (or null), and whether a hand raises it at first. With a serial
  // line it is the real one.
  open(rig, line = null) {
    this.close();
    this.line = line;
    const { port1: here, port2: there } = new MessageChannel();
    this.frame = element('iframe', { srcdoc: JSON.parse(embedded('twin-page')), title: 'The rig under power' });
    this.frame.addEventListener('load', () => {
      this.frame.contentWindow.postMessage(null, '*', [here]);
      this.frame.contentWindow.focus();
    });
    this.show(true);
    byId('twin').append(this.frame);
    this.thread = new Thread(this.module);
    this.thread.run(rig, JSON.parse(embedded('theme')), there, line?.there ?? null, ({ failed }) => {
      if (failed === undefined) return;
      this.close();
      this.failed(failed.why);
    });
  }

  show(isShown) {
    byId('twin').hidden = !isShown;
    for (const place of document.querySelectorAll('main, header, #told')) place.hidden = isShown;
  }

  close() {
    const { line, thread } = this;
    // The motor of a real rig is turned off before its thread ends.
    (line?.close() ?? Promise.resolve()).then(() => thread?.worker.terminate());
    this.frame?.remove();
    [this.frame, this.thread, this.line] = [null, null, null];
    this.show(false);
    byId('balance').focus();
  }
}
