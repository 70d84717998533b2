// What steered a measured trial, from its start: orders each once, or the measured angle from reading to reading.

function programme({ t, angle, rudder: angles, engine: speeds }, hasEngine) {
  const orders = [];
  let [rudderNow, engineNow] = [null, null];
  const read = t.map((_, row) => row).filter((row) => angles[row] !== null);
  const next = new Map(read.slice(0, -1).map((row, place) => [row, read[place + 1]]));
  t.forEach((time, row) => {
    const one = { t: time };
    if (angles[row] !== null && (angle || angles[row] !== rudderNow)) one["rudder.command"] = rudderNow = angles[row];
    if (angle && angles[row] !== null) {
      const after = next.get(row);
      one["ghost.rudder_rate"] = after === undefined ? 0 : (angles[after] - angles[row]) / (t[after] - time);
      one["ghost.steers"] = true;
    }
    if (hasEngine && speeds[row] !== null && speeds[row] !== engineNow) {
      one["propeller.speed"] = engineNow = speeds[row];
    }
    if (Object.keys(one).length > 1) orders.push(one);
  });
  return [...orders, { t: t.at(-1) }];
}
