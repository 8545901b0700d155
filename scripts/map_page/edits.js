// -- what a person corrects: verdicts on doors, doors added, keep-out zones --------------------------

const KEY = `dynslam-map-${DATA.digest}`;
const NOTHING = { verdicts: {}, added: [], zones: [] };

class Edits {
  constructor() {
    this.listeners = [];
    try {
      Object.assign(this, structuredClone(NOTHING), JSON.parse(localStorage.getItem(KEY)));
    } catch { // a browser that keeps nothing for files
      Object.assign(this, structuredClone(NOTHING));
    }
  }

  changed() {
    const { verdicts, added, zones } = this;
    try {
      localStorage.setItem(KEY, JSON.stringify({ verdicts, added, zones }));
    } catch { /* then they last as long as the page */ }
    this.listeners.forEach((listener) => listener());
  }
}
