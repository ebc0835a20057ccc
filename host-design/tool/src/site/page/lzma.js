// The way out of LZMA, as its specification has it: src/site/packed.rs has the way in.

const [LITERAL, SHORTEST] = [0x300, 2];
const bits = (number) => new Uint16Array(number).fill(1024);
const lengths = () => ({ choice: bits(2), short: bits(16 << 3), middle: bits(16 << 3), long: bits(256) });

// Binary decisions out of a range coder; `probs` learns how likely each is.
class RangeDecoder {
  constructor(bytes, at) {
    Object.assign(this, { bytes, at: at + 5, range: 0xffffffff, code: new DataView(bytes.buffer).getUint32(at + 1) });
  }

  shrink() {
    if (this.range >= 0x1000000) return;
    this.range = (this.range << 8) >>> 0;
    this.code = ((this.code << 8) | this.bytes[this.at]) >>> 0;
    this.at += 1;
  }

  bit(probs, index) {
    const likely = probs[index];
    const bound = (this.range >>> 11) * likely;
    const is = this.code >= bound;
    if (is) {
      this.range -= bound;
      this.code -= bound;
      probs[index] = likely - (likely >> 5);
    } else {
      this.range = bound;
      probs[index] = likely + ((2048 - likely) >> 5);
    }
    this.shrink();
    return is ? 1 : 0;
  }

  // A number of `count` bits, the highest or the lowest first.
  tree(probs, count, from = 0) {
    let node = 1;
    for (let bit = 0; bit < count; bit += 1) node = (node << 1) | this.bit(probs, from + node);
    return node - (1 << count);
  }

  reversed(probs, count, from = 0) {
    let [node, number] = [1, 0];
    for (let place = 0; place < count; place += 1) {
      const bit = this.bit(probs, from + node);
      node = (node << 1) | bit;
      number |= bit << place;
    }
    return number;
  }

  even(count) {
    let number = 0;
    for (let bit = 0; bit < count; bit += 1) {
      this.range >>>= 1;
      const is = this.code >= this.range;
      if (is) this.code -= this.range;
      this.shrink();
      number = 2 * number + (is ? 1 : 0);
    }
    return number;
  }

  length({ choice, short, middle, long }, place) {
    if (this.bit(choice, 0) === 0) return SHORTEST + this.tree(short, 3, place << 3);
    if (this.bit(choice, 1) === 0) return SHORTEST + 8 + this.tree(middle, 3, place << 3);
    return SHORTEST + 16 + this.tree(long, 8);
  }
}

// The bytes of a `.lzma` file whose header has their number.
function decoded(packed) {
  const [lc, lp, pb] = [packed[0] % 9, Math.floor(packed[0] / 9) % 5, Math.floor(packed[0] / 45)];
  const out = new Uint8Array(new DataView(packed.buffer).getUint32(5, true));
  const coder = new RangeDecoder(packed, 13);
  const [literals, isMatch, isLong] = [bits(LITERAL << (lc + lp)), bits(12 << 4), bits(12 << 4)];
  const [isRepeated, isFirst, isSecond, isThird] = Array.from({ length: 4 }, () => bits(12));
  const [slots, special, align] = [bits(4 << 6), bits(128), bits(16)];
  const [fresh, repeated] = [lengths(), lengths()];
  let [last, state, at] = [[0, 0, 0, 0], 0, 0];
  const literal = () => {
    const before = at > 0 ? out[at - 1] : 0;
    const from = LITERAL * (((at & ((1 << lp) - 1)) << lc) + (before >> (8 - lc)));
    let node = 1;
    if (state >= 7) {
      let matched = out[at - last[0] - 1];
      while (node < 0x100) {
        const expected = (matched >> 7) & 1;
        matched <<= 1;
        const bit = coder.bit(literals, from + ((1 + expected) << 8) + node);
        node = (node << 1) | bit;
        if (bit !== expected) break;
      }
    }
    while (node < 0x100) node = (node << 1) | coder.bit(literals, from + node);
    out[at] = node;
    at += 1;
    state = state < 4 ? 0 : state < 10 ? state - 3 : state - 6;
  };
  const distance = (length) => {
    const slot = coder.tree(slots, 6, Math.min(length - SHORTEST, 3) << 6);
    if (slot < 4) return slot;
    const count = (slot >> 1) - 1;
    const high = (2 | (slot & 1)) << count;
    if (slot < 14) return high + coder.reversed(special, count, high - slot);
    return high + (coder.even(count - 4) << 4) + coder.reversed(align, 4);
  };
  while (at < out.length) {
    const place = at & ((1 << pb) - 1);
    if (coder.bit(isMatch, (state << 4) + place) === 0) {
      literal();
      continue;
    }
    let length = 1;
    if (coder.bit(isRepeated, state) === 0) {
      length = coder.length(fresh, place);
      last = [distance(length), ...last.slice(0, 3)];
      state = state < 7 ? 7 : 10;
    } else {
      const which = coder.bit(isFirst, state) === 0 ? 0 : coder.bit(isSecond, state) === 0 ? 1 : 2 + coder.bit(isThird, state);
      if (which === 0 && coder.bit(isLong, (state << 4) + place) === 0) state = state < 7 ? 9 : 11;
      else {
        last.unshift(...last.splice(which, 1));
        length = coder.length(repeated, place);
        state = state < 7 ? 8 : 11;
      }
    }
    for (let left = length; left > 0; left -= 1, at += 1) out[at] = out[at - last[0] - 1];
  }
  return out;
}
