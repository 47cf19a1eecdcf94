import { Button, Group, SegmentedControl } from "@mantine/core";
import { IconFileTypePdf, IconPrinter } from "@tabler/icons-react";
import { LANGUAGES, type Language } from "../../lib/language";
import { usePaperLanguage } from "../../lib/paperLanguage";
import { REPORT } from "./messages";

/** The report of a session or an episode: to be printed, or as PDF. In which language is remembered in this browser. */
export function ReportLinks({ of, id }: { of: "sessions" | "episodes"; id: string }) {
  const [language, setLanguage] = usePaperLanguage();
  const address = (kind: "html" | "pdf") => `/api/${of}/${id}/report.${kind}?language=${language}`;
  return (
    <Group gap="sm" role="group" aria-label={REPORT.title}>
      <Button
        component="a"
        href={address("html")}
        target="_blank"
        rel="noreferrer"
        variant="default"
        leftSection={<IconPrinter size={20} />}
      >
        {REPORT.print}
      </Button>
      <Button
        component="a"
        href={address("pdf")}
        download
        variant="default"
        leftSection={<IconFileTypePdf size={20} />}
      >
        {REPORT.pdf}
      </Button>
      <SegmentedControl
        aria-label={REPORT.language}
        size="md"
        value={language}
        onChange={(chosen) => setLanguage(chosen as Language)}
        data={Object.entries(LANGUAGES).map(([value, name]) => ({
          value,
          label: <span lang={value}>{name}</span>,
        }))}
      />
    </Group>
  );
}
