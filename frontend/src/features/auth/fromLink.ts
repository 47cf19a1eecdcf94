/** Return a value from the part of the address after "#" (#link=…), which browsers never send to a server. */
export const readFragment = (name: string): string =>
  new URLSearchParams(location.hash.slice(1)).get(name) ?? "";
