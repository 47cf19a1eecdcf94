import { say } from "../../lib/language";
import type { AuthState } from "./authState";

/** What stands before the page. */
export const DOOR = say(
  {
    oneMoment: "One moment",
    asking: "The page asks the service who is signed in here.",
  },
  {
    oneMoment: "お待ちください",
    asking: "サインインの状態をサービスに確認しています。",
  },
);

export const SIGN_IN = say(
  {
    title: "Sign in",
    username: "User name",
    password: "Password",
    code: "Code",
    codeMeans: "The six digits that your authenticator app shows now, or one of your recovery codes.",
    signIn: "Sign in",
    somebodyElse: "Sign in as somebody else",
    with: (provider: string) => `Sign in with ${provider}`,
    oneTimeCode: "I have a one-time code",
    withoutIt: "Without a sign-in nothing here reaches the apparatus, Stop neither. Use the emergency stop.",
    byName: "Sign in by name",
    oneMoment: "One moment.",
    back: "Back to the page",
    youAreBack: "You are back",
    unlocked: "The screen is unlocked. This tab can be closed.",
    closeTab: "Close this tab",
  },
  {
    title: "サインイン",
    username: "ユーザー名",
    password: "パスワード",
    code: "コード",
    codeMeans: "認証アプリに表示されている6桁の数字、または回復コードを入力してください。",
    signIn: "サインイン",
    somebodyElse: "別の人としてサインイン",
    with: (provider) => `${provider}でサインイン`,
    oneTimeCode: "ワンタイムコードをお持ちの方",
    withoutIt:
      "サインインするまで、この画面から装置は操作できません。「停止」も使えません。非常停止スイッチを使ってください。",
    byName: "ユーザー名でサインイン",
    oneMoment: "お待ちください。",
    back: "ページに戻る",
    youAreBack: "サインインしました",
    unlocked: "画面のロックが解除されました。このタブは閉じてかまいません。",
    closeTab: "このタブを閉じる",
  },
);

/** Why nobody is signed in, where somebody was until now. */
export const WHY = say<Record<Extract<AuthState, { is: "out" }>["why"], string | null>>(
  {
    never: null,
    left: "You are signed out.",
    ended:
      "You have been signed out: it was long since you did something here, or somebody ended it. Sign in to go on where you were.",
    unheard:
      "The service has not confirmed the sign-out yet; the page tries again. Until it has, do not leave this browser to others.",
  },
  {
    never: null,
    left: "サインアウトしました。",
    ended:
      "サインアウトされました。操作のない時間が続いたか、ほかの場所から終了されました。サインインすると、続きから始められます。",
    unheard:
      "サービスがまだサインアウトを確認していません。自動で再試行します。確認が済むまで、このブラウザを他の人に使わせないでください。",
  },
);

export const LOCKED = say(
  {
    title: "Locked",
    who: (name: string) =>
      `${name} is signed in here. What goes on at the apparatus goes on; Stop works without unlocking.`,
    thenUnlocked: "This screen is unlocked then; Stop stays here meanwhile.",
    passwordOf: (name: string) => `Password of ${name}`,
    unlock: "Unlock",
    noPassword: "This account has no password here: sign out, and sign in again.",
    signOut: "Sign out",
    left: (span: string) => `${span} left`,
  },
  {
    title: "画面ロック中",
    who: (name) => `${name}さんがサインイン中です。装置の動作は続いています。「停止」はロック中も使えます。`,
    thenUnlocked: "サインインすると、この画面のロックが解除されます。その間も「停止」は使えます。",
    passwordOf: (name) => `${name}さんのパスワード`,
    unlock: "ロックを解除",
    noPassword: "このアカウントにはパスワードがありません。サインアウトし、サインインし直してください。",
    signOut: "サインアウト",
    left: (span) => `残り ${span}`,
  },
);

/** Showing once more that it is still oneself. */
export const AGAIN = say(
  {
    openId: (provider: string) => `Sign in again with ${provider} `,
    ownTab: (then: string) => `It opens in a tab of its own. ${then}`,
    thenPress: "Then press the button here once more.",
    password: "Your password, once more",
  },
  {
    openId: (provider) => `${provider}で再度サインイン `,
    ownTab: (then) => `別のタブで開きます。${then}`,
    thenPress: "その後、ここのボタンをもう一度押してください。",
    password: "パスワードの再入力",
  },
);

export const PASSWORD = say(
  {
    choose: "New password",
    chooseMeans:
      "Ten characters or more. A few words that do not belong together are easy to remember; common passwords are refused.",
    again: "New password again",
    differs: "These two are not the same.",
    setting: "Set a password",
    settingMeans: "An administrator gives you a one-time code, at the beginning and when you have forgotten.",
    set: "Set the password",
    code: "One-time code",
    back: "Back to signing in",
  },
  {
    choose: "新しいパスワード",
    chooseMeans:
      "10文字以上。関連のない単語をいくつか並べると覚えやすくなります。よく使われるパスワードは使えません。",
    again: "新しいパスワード（再入力）",
    differs: "2つのパスワードが一致しません。",
    setting: "パスワードの設定",
    settingMeans: "ワンタイムコードは管理者が発行します（最初の設定時と、パスワードを忘れたとき）。",
    set: "パスワードを設定",
    code: "ワンタイムコード",
    back: "サインインに戻る",
  },
);

/** The first account. */
export const SET_UP = say(
  {
    title: "First administrator",
    noLink:
      "Open the whole link that the service printed when it was started. If it is lost, somebody at that computer prints another one with “kata accounts link”.",
    means: "This account keeps all others. More accounts are made once it has signed in.",
    make: "Make the account",
    name: "Your name",
    nameMeans: "As it is to stand in records.",
    usernameMeans: "For signing in.",
  },
  {
    title: "最初の管理者",
    noLink:
      "サービスの起動時に表示されたリンク全体を開いてください。わからない場合は、そのコンピュータで「kata accounts link」を実行すると、新しいリンクが表示されます。",
    means: "このアカウントがほかのアカウントを管理します。サインイン後に、ほかのアカウントを作成できます。",
    make: "アカウントを作成",
    name: "名前",
    nameMeans: "記録に表示される名前です。",
    usernameMeans: "サインインに使います。",
  },
);
