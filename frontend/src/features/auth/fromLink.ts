/** What a link carries behind its "#", where no server and no log gets to see it: #link=… */
export const fromLink = (name: string): string => new URLSearchParams(location.hash.slice(1)).get(name) ?? "";
