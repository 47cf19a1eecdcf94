import { say } from "../../lib/language";
import type { Priority } from "./alarms";

/** What each priority is called; its colour says the same once more. */
export const PRIORITY_WORDS = say<Record<Priority, string>>(
  { high: "High priority alarm", medium: "Medium priority alarm", low: "Low priority alarm" },
  { high: "高優先度アラーム", medium: "中優先度アラーム", low: "低優先度アラーム" },
);

export const WORDS = say(
  {
    lost: "Connection lost",
    lostNext:
      "What is greyed out is old. The Stop button may not reach the apparatus: use the emergency stop. The page goes on by itself once the connection is back.",
    lostHeldNext:
      "Support the arm: the motors may still move or hold it. The Stop button may not reach the apparatus: use the emergency stop. What is greyed out is old.",
    restarting: "The apparatus' control program does not answer",
    restartingHeldNext:
      "Support the arm: the motors may still hold it. The control program is started again by itself; no motion is resumed.",
    restartingNext: "It is started again by itself; nothing that moved goes on by itself.",
    estopMissing: "The emergency stop's switch does not answer",
    estopMissingNext: "Nothing can be moved until it does. Check the switch's cable and its drive's power.",
    away: "The browser that operates the apparatus cannot be reached",
    awayNext: "Go to the patient. Somebody can take over here; otherwise the motors let go of the arm.",
    pedal: "The pedal does not answer",
    pedalNext: "Plug it in, and step on it once.",
    reversing: "The arm met resistance and is taken back",
    reversingNext: "Look after the patient before you play on.",
    databaseAway: (since: string) => `The database does not answer since ${since}`,
    databaseAwayNext:
      "Nothing is lost: what happens at the apparatus is kept on this computer and written there when it is back. What has begun goes on, and Stop works; a session can begin for the patients who were here today. Signing in, records and teaching have to wait.",
    notKept: (since: string) =>
      `Since ${since}, what happens at the apparatus is not kept: the disk takes nothing`,
    notKeptNext:
      "End what is going on, make room on this computer's disk, and tell whoever looks after this computer.",
    pauseSound: "Pause the sound for 2 minutes",
    soundPaused: "Sound paused. A new alarm sounds all the same.",
    soundOn: "Sound on again",
    noSound: "This browser gives no sound before somebody has pressed something here.",
  },
  {
    lost: "接続が切れました",
    lostNext:
      "灰色の表示は古い情報です。画面の「停止」は装置に届かないことがあります。非常停止を使ってください。接続が戻ると、ページは自動的に再開します。",
    lostHeldNext:
      "腕を支えてください。モータがまだ腕を動かしている、または保持している可能性があります。画面の「停止」は装置に届かないことがあります。非常停止を使ってください。灰色の表示は古い情報です。",
    restarting: "装置の制御プログラムが応答しません",
    restartingHeldNext:
      "腕を支えてください。モータがまだ腕を保持している可能性があります。制御プログラムは自動的に再起動します。動作は再開されません。",
    restartingNext: "自動的に再起動します。動いていたものが自動的に再開することはありません。",
    estopMissing: "非常停止スイッチが応答しません",
    estopMissingNext:
      "応答があるまで何も動かせません。スイッチのケーブルとドライブの電源を点検してください。",
    away: "装置を操作しているブラウザに接続できません",
    awayNext:
      "患者のところへ行ってください。ここから操作を引き継げます。引き継がないと、モータは腕を離します。",
    pedal: "フットペダルが応答しません",
    pedalNext: "接続して、一度踏んでください。",
    reversing: "腕が抵抗を受けたため、引き戻しています",
    reversingNext: "再生を続ける前に、患者の様子を確かめてください。",
    databaseAway: (since) => `${since} からデータベースが応答していません`,
    databaseAwayNext:
      "失われるものはありません。装置で起きたことはこのコンピュータに保存され、データベースが戻ると書き込まれます。進行中の操作は続けられ、「停止」も働きます。今日このステーションで扱った患者のセッションは開始できます。サインイン、記録の閲覧、教示は待つ必要があります。",
    notKept: (since) => `${since} からディスクに書き込めず、装置で起きたことが保存されていません`,
    notKeptNext:
      "進行中の操作を終え、このコンピュータのディスクに空きを作り、コンピュータの管理担当者に知らせてください。",
    pauseSound: "音を2分間止める",
    soundPaused: "音を止めています。新しいアラームの音は鳴ります。",
    soundOn: "音を再開",
    noSound: "このブラウザでは、画面を一度操作するまで音が鳴りません。",
  },
);
