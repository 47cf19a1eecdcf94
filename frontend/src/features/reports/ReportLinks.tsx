import { Button, Group, SegmentedControl } from "@mantine/core";
import { IconFileTypePdf, IconPrinter } from "@tabler/icons-react";
import { t } from "../../lib/i18n";
import { LANGUAGES, type Language } from "../../lib/language";
import { usePaperLanguage } from "../../lib/paperLanguage";

/**
 * Links to the printable report and the PDF of a session or episode. This browser stores the language. For an episode in Japanese also
 * to the draft of a rehabilitation plan, a form of Japan.
 */
export function ReportLinks({ of, id }: { of: "sessions" | "episodes"; id: string }) {
  const [language, setLanguage] = usePaperLanguage();
  const address = (kind: "html" | "pdf") => `/api/${of}/${id}/report.${kind}?language=${language}`;
  return (
    <Group gap="sm" role="group" aria-label={t("reports:report.title")}>
      <Button
        component="a"
        href={address("html")}
        target="_blank"
        rel="noreferrer"
        variant="default"
        leftSection={<IconPrinter size={20} />}
      >
        {t("reports:report.print")}
      </Button>
      <Button
        component="a"
        href={address("pdf")}
        download
        variant="default"
        leftSection={<IconFileTypePdf size={20} />}
      >
        {t("reports:report.pdf")}
      </Button>
      {of === "episodes" && language === "ja" && (
        <Button
          component="a"
          href={`/api/episodes/${id}/rehabilitation-plan.pdf`}
          download
          variant="default"
          leftSection={<IconFileTypePdf size={20} />}
        >
          {t("reports:report.rehabilitationPlan")}
        </Button>
      )}
      <SegmentedControl
        aria-label={t("reports:report.language")}
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
