export function checkCatalogues(): void;
export function differences(reference: object, translation: object, language: string): string[];
