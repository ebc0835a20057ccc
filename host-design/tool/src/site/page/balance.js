// Balance it: the twin's page inside this one, and the thread that runs its rig.

const RUN = 'upright run'; // names in the tab's store
const SCOPES = 'upright scopes';

// The twin's page, with what this page's script has, too.
function twinPage() {
  const own = document.scripts[document.scripts.length - 1].textContent;
  const shared = own.slice(own.indexOf('const modules'), own.indexOf("'end of what is shared'"));
  return texts().twin.replace('{shared}', () => shared);
}

class Twin {
  // `failed(why)` says why a rig cannot run, `away(is)` that a person is here.
  constructor(module, failed, away) {
    // `falls` are the faults that a person has seen in this page, each with what was not as designed.
    Object.assign(this, { module, failed, away, frame: null, thread: null, line: null, kept: null, falls: [] });
    addEventListener('pagehide', () => this.keep());
    byId('close').addEventListener('click', () => this.close());
    // Stop works wherever the focus is.
    document.addEventListener('keydown', (event) => {
      if (event.key === 'Escape') this.frame?.contentDocument.dispatchEvent(new KeyboardEvent('keydown', { key: 'Escape' }));
    });
  }

  // Switches the rig on: its file, its stored motions (or null), and whether a hand raises it at first. With a serial
  // line it is the real one.
  open(rig, line = null, kept = null) {
    this.close();
    this.line = line;
    this.kept = kept === null ? null : { rig, kept };
    if (kept === null) store()?.removeItem(SCOPES);
    const { port1: here, port2: there } = new MessageChannel();
    this.frame = element('iframe', { srcdoc: twinPage(), title: 'The rig under power' });
    this.frame.addEventListener('load', () => {
      this.frame.contentWindow.postMessage(null, '*', [here]);
      this.frame.contentWindow.focus();
    });
    this.show(true);
    byId('twin').append(this.frame);
    this.thread = new Thread(this.module);
    this.thread.keep = (changes) => { this.kept = { rig, kept: changes }; };
    this.thread.fell = (fall) => { this.falls.push({ toml: rig.toml, ...fall }); };
    this.thread.run({ rig, kept, keeps: true }, JSON.parse(embedded('theme')), there, line?.there ?? null, ({ failed }) => {
      if (failed === undefined) return;
      this.close();
      this.failed(failed.why);
    });
  }

  // A page that is loaded again goes on with the run. A store that is too small keeps nothing.
  keep() {
    store()?.removeItem(RUN);
    if (this.kept === null) return;
    const { rig, kept } = this.kept;
    try { store()?.setItem(RUN, JSON.stringify({ rig, kept: { ...kept, bytes: lettersOf(kept.bytes) } })); } catch {}
  }

  // Goes on with what was kept, if it is of the rig file `toml`.
  goOn(toml) {
    try {
      const { rig, kept } = JSON.parse(store()?.getItem(RUN) ?? 'null') ?? {};
      if (rig?.toml === toml) this.open(rig, null, { ...kept, bytes: bytesOfLetters(kept.bytes) });
    } catch { store()?.removeItem(RUN); } // damaged
  }

  show(isShown) {
    byId('twin').hidden = !isShown;
    for (const place of document.querySelectorAll('main, header, #tabs')) place.hidden = isShown;
    this.away(isShown);
    // An exercise is answered while one looks; its text is folded then.
    byId(isShown ? 'twin' : 'lesson-place').append(byId('lesson'));
    byId('lesson').querySelector('details').open = !isShown;
  }

  close() {
    const { line, thread } = this;
    // The motor of a real rig is turned off before its thread ends.
    (line?.close() ?? Promise.resolve()).then(() => thread?.worker.terminate());
    this.frame?.remove();
    [this.frame, this.thread, this.line, this.kept] = [null, null, null, null];
    this.show(false);
    byId('balance').focus();
  }
}
