/** Return a value from the part of the address after "#" (#link=…). Browsers never send this part to a server. */
export const readFragment = (name: string): string =>
  new URLSearchParams(location.hash.slice(1)).get(name) ?? "";
