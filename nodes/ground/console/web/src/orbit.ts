// Where a satellite on a circular orbit is below and will be, from two points of its ground track; and where the Sun stands.

/** Longitude and latitude [deg]. */
export type Place = [number, number];

type Vector = [number, number, number];

/** The Earth's rate of rotation [rad/s]. */
const EARTH_RATE = 7.2921159e-5;
const RAD = Math.PI / 180;

const direction = ([lon, lat]: Place, turned: number): Vector => {
  const east = lon * RAD + turned;
  return [Math.cos(lat * RAD) * Math.cos(east), Math.cos(lat * RAD) * Math.sin(east), Math.sin(lat * RAD)];
};
const dot = (a: Vector, b: Vector): number => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a: Vector, b: Vector): Vector => [
  a[1] * b[2] - a[2] * b[1],
  a[2] * b[0] - a[0] * b[2],
  a[0] * b[1] - a[1] * b[0],
];
const scaled = (a: Vector, factor: number): Vector => [a[0] * factor, a[1] * factor, a[2] * factor];
const plus = (a: Vector, b: Vector): Vector => [a[0] + b[0], a[1] + b[1], a[2] + b[2]];

export interface Point {
  t: number;
  lon: number;
  lat: number;
}

/** A circular orbit whose plane stands still among the stars. */
export interface Orbit {
  /** Time of its first axis [ms]. */
  t: number;
  /** Rate [rad/s]. */
  rate: number;
  /** Unit vectors of its plane in axes that coincided with the Earth's at `t`. */
  axes: [Vector, Vector];
}

/** The orbit through two points of a ground track; none if they are the same or half an orbit apart. */
export function orbitThrough(before: Point, last: Point): Orbit | undefined {
  const seconds = (last.t - before.t) / 1000;
  const from = direction([before.lon, before.lat], -EARTH_RATE * seconds);
  const to = direction([last.lon, last.lat], 0);
  const across = cross(from, to);
  const sine = Math.hypot(...across);
  if (seconds <= 0 || sine < 1e-9) return undefined;
  const normal = scaled(across, 1 / sine);
  return { t: last.t, rate: Math.atan2(sine, dot(from, to)) / seconds, axes: [to, cross(normal, to)] };
}

/** The point below the satellite at a time [ms]. */
export function placeAt(orbit: Orbit, t: number): Place {
  const seconds = (t - orbit.t) / 1000;
  const angle = orbit.rate * seconds;
  const r = plus(scaled(orbit.axes[0], Math.cos(angle)), scaled(orbit.axes[1], Math.sin(angle)));
  const lon = Math.atan2(r[1], r[0]) - EARTH_RATE * seconds;
  return [wrapped(lon / RAD), Math.asin(Math.max(-1, Math.min(1, r[2]))) / RAD];
}

/** A longitude between -180 and 180 [deg]. */
export function wrapped(lon: number): number {
  return ((((lon + 180) % 360) + 360) % 360) - 180;
}

/** Radius of the circle from which a satellite is seen at an elevation or higher [deg of arc]. */
export function footprintRadius(altitude_m: number, elevation_deg: number): number {
  const earth = 6378136.6;
  const elevation = elevation_deg * RAD;
  return (Math.acos((earth / (earth + altitude_m)) * Math.cos(elevation)) - elevation) / RAD;
}

/** Where the Sun is overhead (Astronomical Almanac's low-precision formula, 0.01 deg between 1950 and 2050). */
export function subsolar(t: number): Place {
  const days = t / 86400000 - 10957.5;
  const mean = (280.46 + 0.9856474 * days) * RAD;
  const anomaly = (357.528 + 0.9856003 * days) * RAD;
  const longitude = mean + (1.915 * Math.sin(anomaly) + 0.02 * Math.sin(2 * anomaly)) * RAD;
  const obliquity = (23.439 - 4e-7 * days) * RAD;
  const ascension = Math.atan2(Math.cos(obliquity) * Math.sin(longitude), Math.cos(longitude));
  const sidereal = (280.46062 + 360.98564737 * days) * RAD;
  return [wrapped((ascension - sidereal) / RAD), Math.asin(Math.sin(obliquity) * Math.sin(longitude)) / RAD];
}
