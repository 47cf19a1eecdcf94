import { Anchor } from "@mantine/core";
import { IconHelp } from "@tabler/icons-react";
import { t } from "../lib/i18n";
import { LANGUAGE } from "../lib/language";
import { manualAddress } from "../lib/manual";

/** Pages and sections of the therapist's manual, which exists in both languages, below its own address. */
const MANUAL = {
  signIn: "#help-sign-in",
  before: "#help-before",
  teaching: "#help-teaching",
  session: "#help-session",
  playing: "#help-playing",
  pain: "#help-pain",
  notes: "#help-notes",
  database: "#help-database",
  alarms: "#help-alarms",
  dose: "dose.html",
  endFeel: "end-feel.html",
  retouch: "retouch.html",
  rhythm: "rhythm.html",
} as const;
/** Guides for administrators and technicians, in English only. */
const GUIDES = {
  backups: "/docs/how-to/back-up-and-restore.html",
  commissioning: "/docs/how-to/commission.html",
  scripts: "/docs/how-to/read-with-scripts.html",
} as const;

export type HelpTopic = keyof typeof MANUAL | keyof typeof GUIDES;

/** Opens the manual at the section about a part of the page, named `subject`. Shows nothing without a manual. */
export function HelpLink({ topic, subject }: { topic: HelpTopic; subject: string }) {
  const manual = manualAddress();
  if (!manual) return null;
  const guide = topic in GUIDES ? GUIDES[topic as keyof typeof GUIDES] : null;
  const help = t(guide && LANGUAGE !== "en" ? "ui:help.openEnglish" : "ui:help.open");
  return (
    <Anchor
      href={guide ?? manual + MANUAL[topic as keyof typeof MANUAL]}
      target="_blank"
      rel="noopener"
      size="sm"
      aria-label={t("ui:help.of", { help, subject })}
      data-screen-only
      style={{ display: "inline-flex", alignItems: "center", gap: 4, minHeight: 24 }}
    >
      <IconHelp size={20} aria-hidden />
      {help}
    </Anchor>
  );
}
