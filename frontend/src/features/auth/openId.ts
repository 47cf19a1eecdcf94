/** The page that leads to the clinic's OpenID provider and receives its response. */
export const OPENID_PATH = "/sign-in/openid";

/**
 * Return the address of the login. `to` is the page to open afterwards; empty for a tab opened only for the
 * login.
 */
export const openIdAddress = (to: string): string => `${OPENID_PATH}#${new URLSearchParams({ to })}`;

/** Return the address of the current page, as the target after the login. */
export const currentAddress = (): string => location.pathname + location.search;
