/** Smallest and largest of many values. */

export function extent(series: Iterable<ArrayLike<number>>): [number, number] {
  let [low, high] = [Infinity, -Infinity];
  for (const values of series)
    for (let k = 0; k < values.length; ++k) {
      const v = values[k]!;
      if (v < low) low = v;
      if (v > high) high = v;
    }
  return low <= high ? [low, high] : [0, 0];
}

/** With room at both ends; never empty. */
export function padded([low, high]: [number, number], share = 0.06): [number, number] {
  const room = high > low ? share * (high - low) : Math.abs(high) || 1;
  return [low - room, high + room];
}

export function largest(values: ArrayLike<number>): number {
  const [low, high] = extent([values]);
  return Math.max(Math.abs(low), Math.abs(high));
}
