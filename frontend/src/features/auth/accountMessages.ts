import { say } from "../../lib/language";
import type { Role } from "./messages";
import { ROLES } from "./messages";

/** Whoever is signed in, and what they can do about it. */
export const MENU = say(
  {
    signedInAs: (name: string) => `Signed in as ${name}`,
    light: "Light page",
    dark: "Dark page, for a dim room",
    lock: "Lock the screen",
    account: "My account",
    signOut: "Sign out",
    stillOnTitle: "The motors may hold or move an arm",
    stillOnMine:
      "You operate the apparatus. Stop it or move the arm back first, or let a colleague take over; then sign out.",
    stillOn: "After you have signed out, this browser has no Stop button.",
    stay: "Stay signed in",
    signOutAnyway: "Sign out all the same",
  },
  {
    signedInAs: (name) => `サインイン中：${name}`,
    light: "明るい画面",
    dark: "暗い画面（暗い部屋用）",
    lock: "画面をロック",
    account: "アカウント",
    signOut: "サインアウト",
    stillOnTitle: "モータが腕を保持または動かしている可能性があります",
    stillOnMine:
      "あなたが装置を操作しています。停止するか腕を戻すか、ほかの担当者に操作を引き継いでから、サインアウトしてください。",
    stillOn: "サインアウトすると、このブラウザに「停止」ボタンは表示されません。",
    stay: "サインインしたままにする",
    signOutAnyway: "それでもサインアウトする",
  },
);

export const ACCOUNT = say(
  {
    title: "My account",
    who: (username: string, role: Role) => `User name ${username}. ${ROLES[role].name}: ${ROLES[role].may}`,
    worksAt: (stations: string[]) => `Works at ${stations.join(", ")}.`,
    password: "Password",
    secondFactor: "Second factor",
    whereSignedIn: "Where you are signed in",
    presentPassword: "Present password",
    changePassword: "Change the password",
    changed: "It is changed. Whoever was signed in as you elsewhere is signed out.",
    thisBrowser: (since: string) => `This browser, since ${since}`,
    anotherBrowser: (address: string, since: string) => `Another browser, at ${address}, since ${since}`,
    lastUsed: (moment: string, agent: string) => `Last used ${moment}. ${agent}`,
    signItOut: "Sign it out",
  },
  {
    title: "アカウント",
    who: (username, role) => `ユーザー名：${username}。${ROLES[role].name}：${ROLES[role].may}`,
    worksAt: (stations) => `担当ステーション：${stations.join("、")}`,
    password: "パスワード",
    secondFactor: "二要素認証",
    whereSignedIn: "サインイン中のブラウザ",
    presentPassword: "現在のパスワード",
    changePassword: "パスワードを変更",
    changed: "変更しました。ほかの場所でのサインインは終了しました。",
    thisBrowser: (since) => `このブラウザ（${since}から）`,
    anotherBrowser: (address, since) => `別のブラウザ：${address}（${since}から）`,
    lastUsed: (moment, agent) => `最終使用：${moment}。${agent}`,
    signItOut: "サインアウトさせる",
  },
);

export const SECOND_FACTOR = say(
  {
    needed: "A second factor is needed",
    neededOf: (role: Role, name: string) =>
      `${ROLES[role].name}s of this clinic sign in with a second factor. You have none yet, ${name}.`,
    there: "There is one: signing in asks for a code of your authenticator app.",
    none: "With a second factor, a password that somebody has seen is not enough to sign in as you: an authenticator app on your phone shows a code that is new every half minute.",
    remove: "Take it away, to do without or to set up another",
    begin: "Set up a second factor",
    scan: "Open the authenticator app on your phone, and let it scan this picture.",
    picture: "QR code for the authenticator app",
    key: "If it cannot scan, type this key into it:",
    digits: "The six digits that it shows now",
    confirm: "Confirm",
    recovery:
      "The second factor is set up. Keep these recovery codes where your phone is not: each of them signs you in once without it. They are not shown again.",
    print: "Print",
    kept: "I have kept them",
  },
  {
    needed: "二要素認証が必要です",
    neededOf: (role, name) =>
      `${name}さん、この施設では${ROLES[role].name}のサインインに二要素認証が必要ですが、まだ設定されていません。`,
    there: "設定済みです。サインイン時に認証アプリのコードを入力します。",
    none: "二要素認証を設定すると、パスワードを知られただけではサインインされません。スマートフォンの認証アプリに、30秒ごとに変わるコードが表示されます。",
    remove: "解除（使用をやめる、または設定し直す）",
    begin: "二要素認証を設定",
    scan: "スマートフォンの認証アプリを開き、この画像を読み取ってください。",
    picture: "認証アプリ用のQRコード",
    key: "読み取れない場合は、次のキーを入力してください：",
    digits: "表示されている6桁の数字",
    confirm: "確認",
    recovery:
      "二要素認証を設定しました。次の回復コードを、スマートフォンとは別の場所に保管してください。1つにつき1回、スマートフォンなしでサインインできます。再び表示することはできません。",
    print: "印刷",
    kept: "保管しました",
  },
);

/** Who sees a record, and how to get in when it has to be. */
export const RECORD = say(
  {
    restrictedTo: (names: string[]) =>
      `Restricted to its care team: ${names.join(", ") || "nobody is in it yet"}.`,
    change: "Change who sees it",
    restrict: "Restrict to a care team",
    whoSees: "Who sees this record",
    onlyTeam: "Only the care team sees it",
    team: "Care team",
    teamMeans: "Others, administrators too, can open it only in an emergency, and are seen doing so.",
    leave: "Leave it as it is",
    save: "Save",
    title: "Restricted record",
    isRestricted: "This record is restricted",
    means:
      "Only the patient’s care team sees it. If care cannot wait, you can open it for four hours. Administrators are told that you did, with your reason, and look at it.",
    why: "Why it has to be opened now",
    whyMeans: "Say what has happened. Do not name the patient.",
    open: "Open it in an emergency",
    back: "Back to the patients",
    opened: (until: string) =>
      `You opened this restricted record in an emergency. It is open to you until ${until}.`,
    writtenDown: "What you read and change in it is written down, and an administrator looks at it.",
  },
  {
    restrictedTo: (names) => `閲覧は担当チームに制限：${names.join("、") || "担当者未設定"}`,
    change: "閲覧できる人を変更",
    restrict: "担当チームだけに制限",
    whoSees: "この記録を閲覧できる人",
    onlyTeam: "担当チームだけが閲覧できる",
    team: "担当チーム",
    teamMeans: "ほかの人（管理者を含む）は緊急時にのみ開くことができ、そのことが記録されます。",
    leave: "変更しない",
    save: "保存",
    title: "閲覧制限中の記録",
    isRestricted: "この記録は閲覧が制限されています",
    means:
      "患者の担当チームだけが閲覧できます。治療のため待てない場合は、4時間だけ開くことができます。開いたことと理由は管理者に通知され、確認されます。",
    why: "今すぐ開く理由",
    whyMeans: "状況を書いてください。患者名は書かないでください。",
    open: "緊急閲覧として開く",
    back: "患者一覧に戻る",
    opened: (until) => `閲覧制限中の記録を緊急閲覧しています。${until}まで閲覧できます。`,
    writtenDown: "閲覧と変更の内容は記録され、管理者が確認します。",
  },
);
