"""Messages about accounts, login and second factors. See :mod:`kata.messages`."""

from typing import Final

from kata.messages import message

USERNAME_TAKEN: Final = message("username_taken", "Another account has this user name.")
CHOOSE_ANOTHER_USERNAME: Final = message("choose_another_username", "Choose another user name.")
OPENID_TAKEN: Final = message("openid_taken", "Another account uses this identity.")
UNLINK_OPENID_FIRST: Final = message("unlink_openid_first", "Unlink the identity from the other account first.")
LAST_ADMINISTRATOR: Final = message("last_administrator", "This is the last administrator.")
APPOINT_ADMINISTRATOR_FIRST: Final = message(
    "appoint_administrator_first", "Make another person an administrator first."
)
OPENID_REFUSED: Final = message("openid_refused", "{provider:name} did not confirm your identity.")
BEGIN_AGAIN_OR_ASK_ADMINISTRATOR: Final = message(
    "begin_again_or_ask_administrator", "Begin again, or ask an administrator."
)
OPENID_UNAVAILABLE: Final = message("openid_unavailable", "{provider:name} does not answer, or answers incorrectly.")
SIGN_IN_WITH_PASSWORD_MEANWHILE: Final = message(
    "sign_in_with_password_meanwhile",
    "Try again in a moment. Users with a password can sign in with it. The apparatus works without the provider, Stop included.",
)
WEAK_PASSWORD: Final = message("weak_password", "This password {reason:text}.")
PASSWORD_TOO_SHORT: Final = message("password_too_short", "must have {characters:d} characters or more")
PASSWORD_COMMON: Final = message("password_common", "is one of the most common passwords")
CHOOSE_ANOTHER_PASSWORD: Final = message(
    "choose_another_password",
    "Choose another password: three or four unrelated words are safe and easy to type.",
)
SIGN_IN_CROWDED: Final = message("sign_in_crowded", "Too many users are signing in right now.")
TRY_AGAIN_IN_A_MOMENT: Final = message("try_again_in_a_moment", "Try again in a moment.")
SECOND_FACTOR_EXISTS: Final = message("second_factor_exists", "A second factor is already set up.")
REMOVE_SECOND_FACTOR_FIRST: Final = message(
    "remove_second_factor_first", "Remove the present second factor first, then set up another one."
)
SECOND_FACTOR_NOT_BEGUN: Final = message(
    "second_factor_not_begun", "The setup of a second factor has not been started."
)
BEGIN_ANEW: Final = message("begin_anew", "Start the setup again.")
CODE_INCORRECT: Final = message("code_incorrect", "The code is incorrect or has expired.")
TYPE_SIX_DIGITS: Final = message("type_six_digits", "Type the six digits that the app shows.")
CODE_INCORRECT_FIELD: Final = message("code_incorrect_field", "is incorrect or has expired")
DEMONSTRATION_CANNOT_UNLOCK: Final = message(
    "demonstration_cannot_unlock", "The demonstration has no password, so the screen cannot be unlocked."
)
SIGN_OUT_INSTEAD: Final = message("sign_out_instead", "Sign out instead.")
TOO_MANY_TRIES: Final = message("too_many_tries", "Too many attempts.")
TRY_AGAIN_IN_SECONDS: Final = message("try_again_in_seconds", "Try again in {seconds:d} seconds.")
SECOND_FACTOR_KEY_MISSING: Final = message(
    "second_factor_key_missing", "Your app's codes cannot be checked: their encryption key is missing."
)
USE_RECOVERY_CODE: Final = message(
    "use_recovery_code", "Use a recovery code, or have an administrator reset your second factor."
)
ACCOUNT_NOT_FOUND: Final = message("account_not_found", "There is no such account.")
LOGIN_SESSION_NOT_FOUND: Final = message("login_session_not_found", "There is no such login session.")
NO_OPENID: Final = message("no_openid", "This clinic has no OpenID provider.")
SET_OPENID_FIRST: Final = message("set_openid_first", "Set KATA_OPENID_ISSUER and KATA_OPENID_CLIENT_ID first.")
OPENID_USELESS_FIELD: Final = message("openid_useless_field", "needs a provider")
OPENID_NOT_BEGUN: Final = message("openid_not_begun", "This login was started in another browser, or too long ago.")
BEGIN_AGAIN: Final = message("begin_again", "Begin the login again.")
OPENID_TOOK_TOO_LONG: Final = message(
    "openid_took_too_long", "This login took too long, or was started in another browser."
)
ACCOUNT_DISABLED: Final = message("account_disabled", "This account is disabled.")
ASK_ADMINISTRATOR: Final = message("ask_administrator", "Ask an administrator.")
SIGN_IN_WITH_NAME: Final = message("sign_in_with_name", "Sign in with name and password.")
CODE_WRONG_OR_USED: Final = message("code_wrong_or_used", "The code is incorrect or was used before.")
WAIT_FOR_NEXT_CODE: Final = message("wait_for_next_code", "Wait for the next code of your app.")
OPENID_NOT_LINKED: Final = message("openid_not_linked", "No account is linked with this identity of {provider:name}.")
HAVE_IDENTITY_LINKED: Final = message(
    "have_identity_linked", "Give this identity to an administrator, who can link it to your account: {identity:name}"
)
ACCESS_TOKEN_NOT_FOUND: Final = message("access_token_not_found", "There is no such access token.")
TOO_MANY_TOKENS: Final = message("too_many_tokens", "You already have {most:d} access tokens, which is the maximum.")
REVOKE_UNUSED_TOKENS: Final = message("revoke_unused_tokens", "Revoke tokens that are no longer used.")
TOKEN_ENDED: Final = message("token_ended", "This access token has expired or was revoked.")
CREATE_ANOTHER_TOKEN: Final = message("create_another_token", "Create another one under My account.")
LOGIN_SESSION_ENDED: Final = message("login_session_ended", "This login session has ended.")
SIGN_IN: Final = message("sign_in", "Sign in.")
NOBODY_SIGNED_IN: Final = message("nobody_signed_in", "No user is signed in at this browser.")
LINK_USED_OR_OLD: Final = message(
    "link_used_or_old", "This link has already been used, has expired, or belongs to another clinic."
)
PRINT_NEW_LINK: Final = message("print_new_link", "Print a new link on the clinic's computer: kata accounts link")
ONE_TIME_CODE_UNFIT: Final = message(
    "one_time_code_unfit", "This code does not belong to this user name, was already used, or has expired."
)
ASK_FOR_NEW_CODE: Final = message("ask_for_new_code", "Ask an administrator for a new code.")
WRONG_NAME_OR_PASSWORD: Final = message("wrong_name_or_password", "User name or password is wrong.")
TRY_AGAIN_OR_ASK_FOR_CODE: Final = message(
    "try_again_or_ask_for_code", "Try again, or ask an administrator for a code."
)
LINK_USED: Final = message("link_used", "This link has already been used, or it belongs to another clinic.")
RESTART_FOR_NEW_LINKS: Final = message("restart_for_new_links", "Restart Kata to get new links.")
SECOND_FACTOR_NEEDED: Final = message("second_factor_needed", "A code of the second factor is also needed.")
TYPE_APP_CODE: Final = message("type_app_code", "Type the code that your app shows.")
WRONG_PASSWORD: Final = message("wrong_password", "This is not your password.")
TRY_AGAIN: Final = message("try_again", "Try again.")
OPENID_NEEDED: Final = message("openid_needed", "Confirm your identity at {provider:name} again.")
SIGN_IN_THERE_FIRST: Final = message("sign_in_there_first", "Sign in at the provider, then try again.")
PASSWORD_NEEDED: Final = message("password_needed", "Confirm with your password.")
GIVE_PASSWORD: Final = message("give_password", "Enter your password.")
