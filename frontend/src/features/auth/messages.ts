import type { Schemas } from "../../lib/api/client";
import { say } from "../../lib/language";

export type Role = Schemas["Me"]["role"];

/** What each role is called, and what it may do: as the service's table of permissions says. */
export const ROLES = say<Record<Role, { name: string; may: string }>>(
  {
    therapist: { name: "Therapist", may: "Keeps patients' records and operates the apparatus." },
    administrator: {
      name: "Administrator",
      may: "May do all that a therapist may, and keeps accounts, audit trail and backups.",
    },
    viewer: { name: "Viewer", may: "Reads patients' records and changes nothing." },
    technician: {
      name: "Technician",
      may: "Looks after the apparatus and its state. Sees no patient's data.",
    },
  },
  {
    therapist: { name: "療法士", may: "患者の記録を管理し、装置を操作します。" },
    administrator: {
      name: "管理者",
      may: "療法士のすべての操作に加え、アカウント、監査証跡、バックアップを管理します。",
    },
    viewer: { name: "閲覧者", may: "患者の記録を閲覧します。変更はできません。" },
    technician: { name: "保守担当者", may: "装置とその状態を管理します。患者のデータは閲覧できません。" },
  },
);

export const LANGUAGE_WORDS = say(
  {
    language: "Language",
    whatItIs: "The page speaks it with you at whichever browser you sign in at.",
    notWhileMoving: "It can be changed once the apparatus stands and has let go of the arm.",
  },
  {
    language: "表示言語",
    whatItIs: "どのブラウザでサインインしても、この言語で表示します。",
    notWhileMoving: "装置が停止し、腕を離すと変更できます。",
  },
);
