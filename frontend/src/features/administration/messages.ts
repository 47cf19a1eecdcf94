import type { Schemas } from "../../lib/api/client";
import { say } from "../../lib/language";

export const ADMINISTRATION = say(
  {
    title: "Administration",
    parts: "Parts of the administration",
    notForYou: "This is for administrators.",
  },
  {
    title: "管理",
    parts: "管理の項目",
    notForYou: "このページは管理者専用です。",
  },
);

export const ACCOUNTS = say(
  {
    title: "Accounts",
    add: "New account",
    name: "Name",
    role: "Role",
    stations: "Stations",
    signsInWith: "Signs in with",
    actions: "What can be done",
    disabled: "Disabled",
    all: "All",
    change: "Change",
    changeOf: (name: string) => `Change ${name}`,
    newCode: "New code",
    newCodeFor: (name: string) => `New code for ${name}`,
    enable: "Enable",
    enableOf: (name: string) => `Enable ${name}`,
    disable: "Disable",
    disableOf: (name: string) => `Disable ${name}`,
    resetting: (name: string) =>
      `With a one-time code ${name} sets a new password. Until then nobody signs in with this account, and whoever is signed in with it is signed out. Make sure who asks for it.`,
    factorLost: "The second factor is lost, too: take it away",
    leave: "Leave it as it is",
    reset: "Make a new code",
    clinicSignIn: "The clinic's own sign-in",
    password: "Password",
    noPassword: "No password yet",
    secondFactor: "Second factor",
    several: (ways: string[]) => ways.join(", "),
  },
  {
    title: "アカウント",
    add: "新しいアカウント",
    name: "名前",
    role: "権限",
    stations: "ステーション",
    signsInWith: "サインイン方法",
    actions: "操作",
    disabled: "無効",
    all: "すべて",
    change: "変更",
    changeOf: (name) => `${name}を変更`,
    newCode: "新しいコード",
    newCodeFor: (name) => `${name}の新しいコード`,
    enable: "有効にする",
    enableOf: (name) => `${name}を有効にする`,
    disable: "無効にする",
    disableOf: (name) => `${name}を無効にする`,
    resetting: (name) =>
      `${name}さんがワンタイムコードで新しいパスワードを設定します。それまでこのアカウントではサインインできず、サインイン中の場合はサインアウトされます。依頼者が本人であることを確認してください。`,
    factorLost: "二要素認証の機器も失った場合：二要素認証を解除する",
    leave: "変更しない",
    reset: "新しいコードを発行",
    clinicSignIn: "施設の共通サインイン",
    password: "パスワード",
    noPassword: "パスワード未設定",
    secondFactor: "二要素認証",
    several: (ways) => ways.join("、"),
  },
);

/** Making an account, or changing one. */
export const FORM = say(
  {
    name: "Name",
    nameMeans: "As it is to stand in records.",
    username: "User name",
    usernameMeans: "For signing in.",
    role: "Role",
    stations: "Stations",
    stationsMean: "Where the apparatus may be operated with this account. None chosen: everywhere.",
    identity: (provider: string) => `Identity at ${provider}`,
    theProvider: "the provider",
    identityMeans:
      "The “sub” by which it knows this person. Whoever is not linked is told theirs when they try to sign in. Empty: cannot sign in by it.",
    save: "Save",
    make: "Make the account",
  },
  {
    name: "名前",
    nameMeans: "記録に表示される名前です。",
    username: "ユーザー名",
    usernameMeans: "サインインに使います。",
    role: "権限",
    stations: "ステーション",
    stationsMean: "このアカウントで装置を操作できるステーション。選ばなければ、すべてのステーション。",
    identity: (provider) => `${provider}の識別子`,
    theProvider: "認証プロバイダ",
    identityMeans:
      "プロバイダがこの人を識別する「sub」の値です。未登録の人には、サインインを試みたときに表示されます。空欄の場合、この方法ではサインインできません。",
    save: "保存",
    make: "アカウントを作成",
  },
);

/** A code that is shown once. */
export const CODE = say(
  {
    title: "One-time code",
    handOver: (until: string) =>
      `Hand this over to whoever it is for, and to nobody else. It is good once, until ${until}, and is not shown again.`,
    username: "User name:",
    code: "One-time code:",
    where: "It is typed at “I have a one-time code” on the sign-in page, or opened as a link.",
    copy: "Copy the link",
    copied: "Copied",
    done: "I have handed it over",
  },
  {
    title: "ワンタイムコード",
    handOver: (until) =>
      `本人だけに渡してください。${until}まで1回だけ使えます。再び表示することはできません。`,
    username: "ユーザー名：",
    code: "ワンタイムコード：",
    where: "サインインページの「ワンタイムコードをお持ちの方」で入力するか、リンクを開いて使います。",
    copy: "リンクをコピー",
    copied: "コピーしました",
    done: "本人に渡しました",
  },
);

export const OUTCOMES = say<Record<Schemas["AuditEntry"]["outcome"], string>>(
  { done: "Done", refused: "Refused", failed: "Failed" },
  { done: "完了", refused: "拒否", failed: "失敗" },
);

export const AUDIT = say(
  {
    title: "Audit trail",
    means:
      "It can only be added to. Whether it is whole, “kata audit verify” tells at the computer that the service runs on.",
    from: "From",
    to: "To",
    who: "Who",
    anybody: "Anybody",
    outcome: "Outcome",
    any: "Any",
    action: "Action",
    showAll: "Show all",
    onePatient: "Only what concerns one patient.",
    nothing: "Nothing matches.",
    number: "No.",
    when: "When",
    what: "What",
    of: "Of",
    fromWhere: "From",
    nobody: "Nobody signed in",
    triedAs: (name: string) => `tried as ${name}`,
    anAccount: "an account",
    why: (reason: string) => `Because: ${reason}`,
    again: (times: number) => `The same again: ${times} times`,
    added: (kinds: string) => `Added: ${kinds}`,
    changed: (kinds: string) => `Changed: ${kinds}`,
    removed: (kinds: string) => `Removed: ${kinds}`,
    several: (kinds: string[]) => kinds.join(", "),
    asWritten: "As it is written down",
    patient: "The patient",
  },
  {
    title: "監査証跡",
    means:
      "記録は追加のみで、変更できません。改ざんの有無は、サービスのコンピュータで「kata audit verify」を実行して確認します。",
    from: "開始日",
    to: "終了日",
    who: "操作者",
    anybody: "全員",
    outcome: "結果",
    any: "すべて",
    action: "操作",
    showAll: "すべて表示",
    onePatient: "1人の患者に関する記録だけを表示しています。",
    nothing: "該当する記録はありません。",
    number: "番号",
    when: "日時",
    what: "操作",
    of: "対象",
    fromWhere: "接続元",
    nobody: "サインインなし",
    triedAs: (name) => `${name}としての試行`,
    anAccount: "アカウント",
    why: (reason) => `理由：${reason}`,
    again: (times) => `同じ操作の繰り返し：${times}回`,
    added: (kinds) => `追加：${kinds}`,
    changed: (kinds) => `変更：${kinds}`,
    removed: (kinds) => `削除：${kinds}`,
    several: (kinds) => kinds.join("、"),
    asWritten: "記録の原文",
    patient: "患者",
  },
);

export const EMERGENCIES = say(
  {
    title: "Emergency access",
    means:
      "Restricted records that somebody opened though they are not in the care team. Look at each: what happened, and whether it was needed.",
    none: "Nobody has opened one.",
    opened: (name: string, moment: string) => `${name}, ${moment}`,
    reviewed: (name: string, moment: string) => `Looked at by ${name}, ${moment}`,
    toReview: "To be looked at",
    done: "What was done in it",
    review: "I have looked at it",
    own: "Somebody else looks at what you did yourself.",
  },
  {
    title: "緊急閲覧",
    means: "担当チーム以外の人が開いた閲覧制限中の記録です。状況と必要性を1件ずつ確認してください。",
    none: "緊急閲覧は行われていません。",
    opened: (name, moment) => `${name}　${moment}`,
    reviewed: (name, moment) => `確認済み（${name}　${moment}）`,
    toReview: "未確認",
    done: "閲覧中の操作を見る",
    review: "確認しました",
    own: "ご自身の緊急閲覧は、ほかの管理者が確認します。",
  },
);

export const BACKUPS = say(
  {
    title: "Backups",
    make: "Back up now",
    making: "A backup is being made, and tried.",
    lastGood: (made: string, tried: string) =>
      `The newest good backup is of ${made}. It was restored to try it on ${tried}, and came back whole and equal.`,
    noneGood: "There is no backup that is known to come back. Make one now.",
    next: (moment: string) => `The next one is made by itself on ${moment}.`,
    never: "None is made by itself: that is switched off.",
    folder: (folder: string) => `They are kept, encrypted, in ${folder}.`,
    sameDisk:
      "That is the same disk as the database’s, and is lost with it. Choose another one with KATA_BACKUP_DIR.",
    keyFile: (file: string) => ` The file is ${file}.`,
    made: "Made",
    tried: "Tried",
    size: "Size",
    file: "File",
    byItself: "By itself",
    askedFor: "Asked for",
    gone: "Not on this computer",
    failed: (problem: string) => `It could not be made: ${problem}`,
    notRestorable: (problem: string) => `Not known to be restorable: ${problem}`,
    notTried: "Not tried yet",
    cameBack: (moment: string) => `Came back whole and equal, ${moment}`,
    auditWhole: (rows: number) => `The audit trail in it is whole: ${rows} rows.`,
    auditBroken: (told: string) => `The audit trail in it is not whole: ${told}`,
  },
  {
    title: "バックアップ",
    make: "今すぐバックアップ",
    making: "バックアップを作成し、復元を確認しています。",
    lastGood: (made, tried) =>
      `復元を確認した最新のバックアップは ${made} のものです。${tried} に試験的に復元し、内容が完全に一致しました。`,
    noneGood: "復元を確認したバックアップがありません。今すぐ作成してください。",
    next: (moment) => `次の自動バックアップ：${moment}`,
    never: "自動バックアップは停止しています。",
    folder: (folder) => `暗号化して ${folder} に保存しています。`,
    sameDisk:
      "データベースと同じディスクのため、故障すると一緒に失われます。KATA_BACKUP_DIR で別のディスクを指定してください。",
    keyFile: (file) => `鍵のファイルは ${file} です。`,
    made: "作成",
    tried: "復元の確認",
    size: "サイズ",
    file: "ファイル",
    byItself: "自動",
    askedFor: "手動",
    gone: "このコンピュータにはなし",
    failed: (problem) => `作成できませんでした：${problem}`,
    notRestorable: (problem) => `復元を確認できません：${problem}`,
    notTried: "未確認",
    cameBack: (moment) => `完全に一致（${moment}）`,
    auditWhole: (rows) => `監査証跡は完全です（${rows}件）。`,
    auditBroken: (told) => `監査証跡に欠損または改変があります：${told}`,
  },
);

/** Where the key of the backups is. */
export const KEYS = say<Record<Schemas["BackupList"]["key"], string>>(
  {
    here: "Without the key nobody can read a backup. It is on this computer, and is lost with it: keep a copy of the file elsewhere.",
    elsewhere:
      "The key is not on this computer, so that backups cannot be tried here. Try one where the key is.",
    nowhere: "No key has been made yet; the first backup makes it.",
  },
  {
    here: "鍵がなければ、誰もバックアップを読めません。鍵はこのコンピュータにあり、故障すると失われます。鍵のファイルの写しを別の場所に保管してください。",
    elsewhere:
      "鍵がこのコンピュータにないため、ここでは復元を確認できません。鍵のある場所で確認してください。",
    nowhere: "鍵はまだありません。最初のバックアップで作成されます。",
  },
);
