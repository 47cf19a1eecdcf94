/** The screen that leads to the clinic's OpenID provider, and that the provider leads back to. */
export const OPENID_PATH = "/sign-in/openid";

/** The way there. `to`: the screen that is wanted afterwards; empty: none, the tab was opened for this alone. */
export const openIdAddress = (to: string): string => `${OPENID_PATH}#${new URLSearchParams({ to })}`;

/** The screen that is open now, as the way back to it. */
export const hereNow = (): string => location.pathname + location.search;
