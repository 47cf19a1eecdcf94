/** The page that redirects to the clinic's OpenID provider and receives its response. */
export const OPENID_PATH = "/sign-in/openid";

/**
 * Return the address of the login. `to` is the page to open afterwards; it is empty for a tab that is opened
 * only for the login.
 */
export const openIdAddress = (to: string): string => `${OPENID_PATH}#${new URLSearchParams({ to })}`;

/** Return the address of the current page, which the login opens afterwards. */
export const currentAddress = (): string => location.pathname + location.search;
