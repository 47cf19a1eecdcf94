import type { Session } from "../../lib/api/client";
import { say } from "../../lib/language";

/** How a session ended. */
export const END_REASONS = say<Record<NonNullable<Session["end_reason"]>, string>>(
  {
    completed: "Completed as planned",
    shortened: "Shortened by the therapist",
    stopped: "Ended by a stop",
    patient_request: "At the patient's request",
    other: "Other",
  },
  {
    completed: "予定どおり終了",
    shortened: "療法士が短縮",
    stopped: "停止のため終了",
    patient_request: "患者の希望により終了",
    other: "その他",
  },
);

/** The note of a session. */
export const NOTE = say(
  {
    title: "Note",
    nothing: "Nothing is written yet.",
    label: "Note of this session",
    drafted: "Drafted from what was measured. Read it, and change what is not so.",
    saved: "Saved",
    notSaved: "Not saved yet",
    anew: "Draft it anew",
    signAs: (who: string) => `Sign as ${who}`,
    onceSigned: "Once signed, the note stays as it is.",
    arriving: "The record of this session is still being saved. You can sign when it is complete.",
    howEnded: "How did it end?",
    end: "End the session",
    signedBy: (who: string, when: string) => `Signed by ${who}, ${when}`,
    addendumBy: (who: string, when: string) => `Addendum by ${who}, ${when}`,
    addendum: "Addendum",
    addendumIs: "The signed note stays as it is; what is to be added stands below it.",
    addAs: (who: string) => `Add as ${who}`,
  },
  {
    title: "所見",
    nothing: "まだ記入されていません。",
    label: "このセッションの所見",
    drafted: "測定結果から作成した下書きです。内容を確かめ、違うところを直してください。",
    saved: "保存済み",
    notSaved: "未保存",
    anew: "下書きを作り直す",
    signAs: (who) => `${who}として署名`,
    onceSigned: "署名すると、所見は変更できなくなります。",
    arriving: "このセッションの記録を保存しています。保存が終わると署名できます。",
    howEnded: "終了理由",
    end: "セッションを終了",
    signedBy: (who, when) => `署名：${who}（${when}）`,
    addendumBy: (who, when) => `追記：${who}（${when}）`,
    addendum: "追記",
    addendumIs: "署名済みの所見は変更されません。追記は所見の下に表示されます。",
    addAs: (who) => `${who}として追記`,
  },
);
