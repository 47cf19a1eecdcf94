"""Messages about accounts, login and second factors. See :mod:`kata.messages`."""

from typing import Final

from kata.messages import message

USERNAME_TAKEN: Final = message("username_taken", "Another account has this user name.")
CHOOSE_ANOTHER_USERNAME: Final = message("choose_another_username", "Choose another one.")
OPENID_TAKEN: Final = message("openid_taken", "Another account uses this identity.")
UNLINK_OPENID_FIRST: Final = message("unlink_openid_first", "Unlink it from that account first.")
LAST_ADMINISTRATOR: Final = message("last_administrator", "This is the last administrator.")
APPOINT_ADMINISTRATOR_FIRST: Final = message(
    "appoint_administrator_first", "Make another person an administrator first."
)
OPENID_REFUSED: Final = message("openid_refused", "{provider:name} did not confirm who you are.")
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
    "Choose another one: three or four unrelated words are safe and easy to type.",
)
SIGN_IN_CROWDED: Final = message("sign_in_crowded", "Too many people are signing in just now.")
TRY_AGAIN_IN_A_MOMENT: Final = message("try_again_in_a_moment", "Try again in a moment.")
SECOND_FACTOR_EXISTS: Final = message("second_factor_exists", "A second factor is already set up.")
REMOVE_SECOND_FACTOR_FIRST: Final = message("remove_second_factor_first", "Remove it first, then set up another one.")
SECOND_FACTOR_NOT_BEGUN: Final = message("second_factor_not_begun", "No second factor is being set up.")
BEGIN_ANEW: Final = message("begin_anew", "Start again.")
CODE_INCORRECT: Final = message("code_incorrect", "The code is incorrect or has expired.")
TYPE_SIX_DIGITS: Final = message("type_six_digits", "Type the six digits that the app shows.")
CODE_INCORRECT_FIELD: Final = message("code_incorrect_field", "is incorrect or has expired")
DEMONSTRATION_CANNOT_UNLOCK: Final = message(
    "demonstration_cannot_unlock", "The demonstration has no password to unlock the screen with."
)
SIGN_OUT_INSTEAD: Final = message("sign_out_instead", "Sign out instead.")
TOO_MANY_TRIES: Final = message("too_many_tries", "Too many tries.")
TRY_AGAIN_IN_SECONDS: Final = message("try_again_in_seconds", "Try again in {seconds:d} seconds.")
SECOND_FACTOR_KEY_MISSING: Final = message(
    "second_factor_key_missing", "Your app's codes cannot be checked: their encryption key is missing."
)
USE_RECOVERY_CODE: Final = message(
    "use_recovery_code", "Use a recovery code, or have an administrator reset your second factor."
)
ACCOUNT_NOT_FOUND: Final = message("account_not_found", "There is no such account.")
LOGIN_SESSION_NOT_FOUND: Final = message("login_session_not_found", "There is no such sign-in.")
